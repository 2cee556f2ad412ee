#include "io/store/seams.h"

#include <algorithm>

namespace btms {

Seams::Seams(const std::vector<ShardEntry>& shards) : shards_(shards) {
  for (std::size_t s = 0; s < shards.size(); ++s) at_.emplace(shards[s].id, s);
}

// Calls fn(pair, corners) for every shard that has corners in common with this one.
template <class Fn>
void Seams::each_neighbour(std::size_t shard, Fn&& fn) const {
  const ShardEntry& own = shards_[shard];
  const CellBox a = own.bounds();
  for (std::int32_t dy = -1; dy <= 1; ++dy)
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      const auto other = at_.find({own.id.tx + dx, own.id.ty + dy});
      if (other == at_.end() || other->second == shard) continue;
      const CellBox b = shards_[other->second].bounds();
      const CellBox corners{std::max(a.col0, b.col0), std::max(a.row0, b.row0), std::min(a.col1, b.col1),
                            std::min(a.row1, b.row1)};
      if (corners.col0 <= corners.col1 && corners.row0 <= corners.row1)
        fn(Pair(std::minmax(shard, other->second)), corners);
    }
}

void Seams::add(std::size_t shard, const TerrainTile& content) {
  each_neighbour(shard, [&](const Pair& pair, const CellBox& corners) {
    Strip strip{shard == pair.first, corners, {}};
    for (std::int32_t row = corners.row0; row <= corners.row1; ++row)
      for (std::int32_t col = corners.col0; col <= corners.col1; ++col)
        strip.heights_mm.push_back(content.corner_mm[content.corner_index({col, row})]);
    put(pair, std::move(strip));
  });
}

void Seams::skip(std::size_t shard) {
  each_neighbour(shard, [&](const Pair& pair, const CellBox& corners) {
    put(pair, {shard == pair.first, corners, {}});
  });
}

// The first of a pair waits for the second.
void Seams::put(const Pair& pair, Strip strip) {
  const std::lock_guard lock(mutex_);
  const auto other = waiting_.find(pair);
  if (other == waiting_.end()) {
    waiting_.emplace(pair, std::move(strip));
    return;
  }
  const Strip& known = other->second;
  if (!known.heights_mm.empty() && !strip.heights_mm.empty())
    compare(pair, strip.of_first ? strip : known, strip.of_first ? known : strip);
  waiting_.erase(other);
}

void Seams::join(Ranks& ranks) {
  if (ranks.size() == 1) return;
  problems_ = ranks.gather(problems_);
  std::vector<std::int32_t> mine;  // strips whose other shard another rank has
  for (const auto& [pair, strip] : waiting_) {
    const CellBox& c = strip.corners;
    mine.insert(mine.end(),
                {static_cast<std::int32_t>(pair.first), static_cast<std::int32_t>(pair.second), strip.of_first, c.col0,
                 c.row0, c.col1, c.row1, static_cast<std::int32_t>(strip.heights_mm.size())});
    mine.insert(mine.end(), strip.heights_mm.begin(), strip.heights_mm.end());
  }
  waiting_.clear();
  const std::vector<std::int32_t> all = ranks.gather(mine);
  for (auto at = all.begin(); at != all.end();) {
    const auto heights = at + 8, end = heights + at[7];
    put({at[0], at[1]}, {at[2] != 0, {at[3], at[4], at[5], at[6]}, {heights, end}});
    at = end;
  }
}

// A tile leaves out heights that none of its own nodes needs: those can't disagree.
void Seams::compare(const Pair& pair, const Strip& first, const Strip& second) {
  SeamProblem problem{pair.first, pair.second, 0, {}, 0, 0};
  std::size_t i = 0;
  for (std::int32_t row = first.corners.row0; row <= first.corners.row1; ++row)
    for (std::int32_t col = first.corners.col0; col <= first.corners.col1; ++col, ++i) {
      const std::int32_t a = first.heights_mm[i], b = second.heights_mm[i];
      if (a == b || a == kUnknownHeight_mm || b == kUnknownHeight_mm) continue;
      if (problem.corners++ == 0) problem = {pair.first, pair.second, 1, {col, row}, a, b};
    }
  if (problem.corners > 0) problems_.push_back(problem);
}

}  // namespace btms
