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
    Strip strip{corners, {}};
    for (std::int32_t row = corners.row0; row <= corners.row1; ++row)
      for (std::int32_t col = corners.col0; col <= corners.col1; ++col)
        strip.heights_mm.push_back(content.corner_mm[content.corner_index({col, row})]);
    const std::lock_guard lock(mutex_);
    const auto other = waiting_.find(pair);
    if (other == waiting_.end()) {
      waiting_.emplace(pair, std::move(strip));
      return;
    }
    const Strip& known = other->second;
    if (!known.heights_mm.empty())
      compare(pair, shard == pair.first ? strip : known, shard == pair.first ? known : strip);
    waiting_.erase(other);
  });
}

void Seams::skip(std::size_t shard) {
  each_neighbour(shard, [&](const Pair& pair, const CellBox& corners) {
    const std::lock_guard lock(mutex_);
    if (waiting_.erase(pair) == 0) waiting_.emplace(pair, Strip{corners, {}});
  });
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
