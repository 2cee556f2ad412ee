#include "engine/tiling/label.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "engine/error.h"
#include "engine/lattice/divider.h"
#include "engine/lattice/plane.h"

namespace btms {
namespace {

constexpr std::size_t kBlockPoints = 1 << 15;
constexpr std::size_t kCacheBytes = std::size_t{512} << 20;

// A node's final plane, ready for Eq 14: a point at offset (x, y) from the square's centre and height z above its
// centre corner is terrain when z - (a x + b y) <= terrain, and far below when it is < below; millimetres, measured
// vertically.
struct LabelPlane {
  float a, b;
  float terrain, below;
};

// A tile's planes.
struct LabelTile {
  CellBox box;
  std::vector<std::int32_t> centre_mm;  // per cell
  std::vector<LabelPlane> planes;       // per node; without a final plane nothing is terrain and nothing below

  LabelTile(const TerrainTile& tile, const Parameters& p) : box(tile.box), centre_mm(tile.centre_mm) {
    const auto r = static_cast<float>(tile.resolution_mm);
    const auto eps3 = static_cast<float>(p.terrain_distance_m * 1000), below = static_cast<float>(-p.below_m * 1000);
    const bool coarse_to_fine = p.method == Method::kCoarseToFine;
    planes.resize(tile.nodes.size());
    std::size_t i = 0;
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t, ++i) {
          if (tile.nodes[i].state == NodeState::kUnknown) {
            planes[i] = {0, 0, -INFINITY, -INFINITY};
            continue;
          }
          const FinalPlane plane = FinalPlane::through(t, tile.corners_mm({{col, row}, t}));
          const float a = static_cast<float>(plane.rise_x_mm) / r, b = static_cast<float>(plane.rise_y_mm) / r;
          if (coarse_to_fine) {  // the threshold follows the place
            const float slope = std::min(std::sqrt(a * a + b * b), static_cast<float>(p.label_slope_cap));
            planes[i] = {a, b, static_cast<float>(tile.nodes[i].terrain_mm),
                         -static_cast<float>(p.level_below_m * 1000) * (1 + slope / 3)};
            continue;
          }
          const float secant = std::sqrt(1 + a * a + b * b);  // p . s + d = vertical distance / secant
          planes[i] = {a, b, eps3 * secant, below * secant};
        }
  }
  std::size_t bytes() const { return planes.size() * sizeof(LabelPlane) + centre_mm.size() * sizeof(std::int32_t); }
};

// Tiles in use, least recently used first out. A tile is loaded outside the lock, so that threads wait only for the
// tile they want.
class LabelTiles {
 public:
  LabelTiles(const TileSource& map, const Parameters& parameters) : map_(map), parameters_(parameters) {}

  // nullptr where the map has no tile.
  std::shared_ptr<const LabelTile> get(TileId id) {
    std::shared_ptr<Entry> entry;
    {
      const std::lock_guard lock(mutex_);
      std::shared_ptr<Entry>& slot = entries_[id];
      if (!slot) {
        slot = std::make_shared<Entry>();
        order_.push_front(id);
        slot->position = order_.begin();
      } else {
        order_.splice(order_.begin(), order_, slot->position);
      }
      entry = slot;
    }
    const std::lock_guard loading(entry->mutex);
    if (!entry->loaded) {
      if (const auto source = map_.load(id)) entry->tile = std::make_shared<const LabelTile>(*source, parameters_);
      entry->loaded = true;
      account(*entry, kEntryBytes + (entry->tile ? entry->tile->bytes() : 0));
    }
    return entry->tile;
  }

 private:
  struct Entry {
    std::mutex mutex;
    bool loaded = false;
    std::shared_ptr<const LabelTile> tile;
    std::list<TileId>::iterator position;  // these three are guarded by LabelTiles::mutex_
    std::size_t bytes = 0;                 // 0 while it is being loaded
    bool forgotten = false;
  };
  static constexpr std::size_t kEntryBytes = 256;

  // Counts a tile that has just been loaded and forgets the oldest ones beyond the cache's size.
  void account(Entry& loaded, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (loaded.forgotten) return;
    loaded.bytes = bytes;
    bytes_ += bytes;
    while (bytes_ > kCacheBytes && order_.size() > 1) {
      const auto oldest = entries_.find(order_.back());
      bytes_ -= oldest->second->bytes;
      oldest->second->forgotten = true;
      entries_.erase(oldest);
      order_.pop_back();
    }
  }

  const TileSource& map_;
  const Parameters& parameters_;
  std::mutex mutex_;
  std::list<TileId> order_;
  std::unordered_map<TileId, std::shared_ptr<Entry>, TileIdHash> entries_;
  std::size_t bytes_ = 0;
};

// Columns or rows of a block's points: whole cells and the offset from their centres.
struct Axis {
  std::vector<std::int32_t> cell;
  std::vector<std::int32_t> offset2;  // half millimetres

  void locate(const std::vector<std::int64_t>& at_mm, const std::vector<std::int64_t>& valid, std::int32_t r_mm) {
    const std::size_t n = at_mm.size();
    cell.resize(n);
    offset2.resize(n);
    std::int64_t low = INT64_MAX, high = INT64_MIN;
    for (std::size_t i = 0; i < n; ++i) {
      if (valid[i] == PointBlock::kDroppedX) continue;
      low = std::min(low, at_mm[i]);
      high = std::max(high, at_mm[i]);
    }
    if (low > high) return;  // every point dropped
    const std::int64_t first = floor_div(low, r_mm), base = first * r_mm;
    if (high - base <= Divider::kMaxOffset) {
      const Divider divide(static_cast<std::uint32_t>(r_mm));
      for (std::size_t i = 0; i < n; ++i) {
        // Unsigned: dropped points wrap to nonsense that nobody looks at.
        const auto u =
            static_cast<std::uint32_t>(static_cast<std::uint64_t>(at_mm[i]) - static_cast<std::uint64_t>(base));
        const std::uint32_t c = divide(u);
        cell[i] = static_cast<std::int32_t>(first) + static_cast<std::int32_t>(c);
        offset2[i] = static_cast<std::int32_t>(2 * (u - c * static_cast<std::uint32_t>(r_mm)) -
                                               static_cast<std::uint32_t>(r_mm));
      }
      return;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (valid[i] == PointBlock::kDroppedX) continue;
      const std::int64_t c = floor_div(at_mm[i], r_mm);
      cell[i] = static_cast<std::int32_t>(c);
      offset2[i] = static_cast<std::int32_t>(2 * (at_mm[i] - c * r_mm) - r_mm);
    }
  }
};

struct Scratch {
  PointBlock block;
  Axis col, row;
  std::vector<Label> labels;
  TileId tile_id{INT32_MIN, INT32_MIN};
  std::shared_ptr<const LabelTile> tile;  // the one the last point fell into
  LabelCounts counts;
};

void label_block(Scratch& s, const MapLayout& layout, LabelTiles& tiles) {
  const std::size_t n = s.block.size();
  s.labels.resize(n);
  s.col.locate(s.block.x_mm, s.block.x_mm, layout.lattice.resolution_mm());
  s.row.locate(s.block.y_mm, s.block.x_mm, layout.lattice.resolution_mm());
  for (std::size_t i = 0; i < n; ++i) {
    if (s.block.x_mm[i] == PointBlock::kDroppedX) {
      s.labels[i] = Label::kDropped;
      ++s.counts.dropped;
      continue;
    }
    const Cell cell{s.col.cell[i], s.row.cell[i]};
    if (!s.tile || !s.tile->box.contains(cell)) {
      const TileId id = layout.grid.tile_of(cell);
      if (id != s.tile_id) {
        s.tile = tiles.get(id);
        s.tile_id = id;
      }
      if (!s.tile || !s.tile->box.contains(cell)) {
        s.labels[i] = Label::kObstacle;
        ++s.counts.obstacle;
        ++s.counts.outside;
        continue;
      }
    }
    const std::size_t square = static_cast<std::size_t>(
        (std::int64_t{cell.row} - s.tile->box.row0) * s.tile->box.cols() + (cell.col - s.tile->box.col0));
    const LabelPlane& plane = s.tile->planes[square * kTriangles + triangle_of(s.col.offset2[i], s.row.offset2[i])];
    const std::int64_t dz = std::int64_t{s.block.z_mm[i]} - s.tile->centre_mm[square];
    const float above = static_cast<float>(dz) - (plane.a * (0.5f * static_cast<float>(s.col.offset2[i])) +
                                                  plane.b * (0.5f * static_cast<float>(s.row.offset2[i])));
    // Eq 14
    const Label label = above < plane.below      ? Label::kBelow
                        : above <= plane.terrain ? Label::kTerrain
                                                 : Label::kObstacle;
    s.labels[i] = label;
    s.counts.terrain += label == Label::kTerrain;
    s.counts.below += label == Label::kBelow;
    s.counts.obstacle += label == Label::kObstacle;
    s.counts.outside += plane.terrain == -INFINITY;
  }
}

}  // namespace

LabelCounts label_points(const PointSource& source, const TileSource& map, const Parameters& parameters,
                         const Threads& threads, const LabelConsumer& consumer, Progress& progress) {
  LabelTiles tiles(map, parameters);
  std::vector<Scratch> scratch(static_cast<std::size_t>(threads.count()));
  const MapLayout layout = map.layout();
  progress.begin("label", source.size(), "points");
  const auto blocks = static_cast<std::size_t>((source.size() + kBlockPoints - 1) / kBlockPoints);
  threads.for_each(blocks, [&](std::size_t i, int worker) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped while labelling");
    Scratch& s = scratch[static_cast<std::size_t>(worker)];
    const std::uint64_t first = std::uint64_t{i} * kBlockPoints;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(kBlockPoints, source.size() - first));
    source.read(first, count, s.block);
    label_block(s, layout, tiles);
    consumer(first, s.labels);
    progress.advance(count);
  });
  LabelCounts all;
  for (const Scratch& s : scratch) {
    all.terrain += s.counts.terrain;
    all.obstacle += s.counts.obstacle;
    all.below += s.counts.below;
    all.dropped += s.counts.dropped;
    all.outside += s.counts.outside;
  }
  return all;
}

}  // namespace btms
