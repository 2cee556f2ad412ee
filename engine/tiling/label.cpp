#include "engine/tiling/label.h"

#include <smmintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "engine/error.h"
#include "engine/lattice/divider.h"
#include "engine/lattice/plane.h"
#include "engine/lattice/wide.h"

namespace btms {
namespace {

constexpr std::size_t kBlockPoints = 1 << 14;  // per read and write: records and columns share the second-level cache
constexpr std::size_t kChunkPoints = 1 << 11;  // located and labelled at a time, in the first-level cache

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
  LabelTiles(const TileSource& map, const Parameters& parameters, std::size_t cache_bytes)
      : map_(map), parameters_(parameters), cache_bytes_(cache_bytes) {}

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
      if (const auto source = map_.load_for_labels(id))
        entry->tile = std::make_shared<const LabelTile>(*source, parameters_);
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
    while (bytes_ > cache_bytes_ && order_.size() > 1) {
      const auto oldest = entries_.find(order_.back());
      bytes_ -= oldest->second->bytes;
      oldest->second->forgotten = true;
      entries_.erase(oldest);
      order_.pop_back();
    }
  }

  const TileSource& map_;
  const Parameters& parameters_;
  const std::size_t cache_bytes_;
  std::mutex mutex_;
  std::list<TileId> order_;
  std::unordered_map<TileId, std::shared_ptr<Entry>, TileIdHash> entries_;
  std::size_t bytes_ = 0;
};

// Columns or rows of a chunk of points: whole cells and the offset from their centres.
struct Axis {
  static constexpr std::int32_t kDropped = INT32_MIN;  // no cell

  std::int32_t cell[kChunkPoints];
  std::int32_t offset2[kChunkPoints];  // half millimetres

  // x_mm says which points were dropped; their offsets are nonsense that nobody looks at.
  void locate(const std::int64_t* at_mm, const std::int64_t* x_mm, std::size_t n, bool any_dropped, std::int32_t r_mm) {
    std::size_t valid = 0;
    while (any_dropped && valid < n && x_mm[valid] == PointBlock::kDroppedX) ++valid;
    if (valid < n && !divide_near(at_mm, x_mm, n, at_mm[valid], r_mm)) divide_far(at_mm, x_mm, n, r_mm);
    if (!any_dropped) return;
    for (std::size_t i = 0; i < n; ++i)
      if (x_mm[i] == PointBlock::kDroppedX) cell[i] = kDropped;
  }

 private:
  // By multiplication; false when a point is too far from `middle` for that.
  BTMS_WIDE bool divide_near(const std::int64_t* at_mm, const std::int64_t* x_mm, std::size_t n, std::int64_t middle,
                             std::int32_t r_mm) {
    const auto r = static_cast<std::uint32_t>(r_mm);
    const Divider divide(r);
    const std::int64_t first = floor_div(middle - Divider::kMaxOffset / 2, r_mm);
    const auto base = static_cast<std::uint64_t>(first * r_mm);
    std::uint64_t offsets = 0;  // the bits of all
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t offset = static_cast<std::uint64_t>(at_mm[i]) - base;
      offsets |= x_mm[i] == PointBlock::kDroppedX ? 0 : offset;
      const auto u = static_cast<std::uint32_t>(offset);
      const std::uint32_t c = divide(u);
      cell[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(first) + c);
      offset2[i] = static_cast<std::int32_t>(2 * (u - c * r) - r);
    }
    static_assert((Divider::kMaxOffset & (Divider::kMaxOffset + 1)) == 0, "all ones");
    return offsets <= Divider::kMaxOffset;
  }
  void divide_far(const std::int64_t* at_mm, const std::int64_t* x_mm, std::size_t n, std::int32_t r_mm) {
    for (std::size_t i = 0; i < n; ++i) {
      if (x_mm[i] == PointBlock::kDroppedX) continue;
      const std::int64_t c = floor_div(at_mm[i], r_mm);
      cell[i] = static_cast<std::int32_t>(c);
      offset2[i] = static_cast<std::int32_t>(2 * (at_mm[i] - c * r_mm) - r_mm);
    }
  }
};

// Points over one tile: columns of a chunk from its `first` on.
struct Run {
  const Axis& col;
  const Axis& row;
  const std::int32_t* z_mm;  // of the chunk
  std::size_t first, end;
};

// How many points from `first` on lie inside the box, without a gap.
BTMS_WIDE std::size_t end_inside(const Axis& col, const Axis& row, std::size_t first, std::size_t n,
                                 const CellBox& box) {
  const auto inside = [&](std::size_t i) {  // no `&&`: the loop over all of them has no branch
    return static_cast<std::int32_t>(col.cell[i] >= box.col0) & static_cast<std::int32_t>(col.cell[i] < box.col1) &
           static_cast<std::int32_t>(row.cell[i] >= box.row0) & static_cast<std::int32_t>(row.cell[i] < box.row1);
  };
  constexpr std::size_t kAtOnce = 64;  // shuffled points leave the tile at once
  std::size_t end = first;
  while (end + kAtOnce <= n) {
    std::int32_t all = 1;
    for (std::size_t i = 0; i < kAtOnce; ++i) all &= inside(end + i);
    if (all == 0) break;
    end += kAtOnce;
  }
  while (end < n && inside(end) != 0) ++end;
  return end;
}

// Index of each point's node in its tile.
BTMS_WIDE void find_nodes(const Run& run, const CellBox& box, std::uint32_t* nodes) {
  const auto cols = static_cast<std::uint32_t>(box.cols());
  for (std::size_t i = run.first; i < run.end; ++i) {
    const auto square = static_cast<std::uint32_t>(run.row.cell[i] - box.row0) * cols +
                        static_cast<std::uint32_t>(run.col.cell[i] - box.col0);
    const std::int32_t u2 = run.col.offset2[i], v2 = run.row.offset2[i];
    const std::uint32_t p = static_cast<std::uint32_t>(u2 + v2) >> 31, q = static_cast<std::uint32_t>(u2 - v2) >> 31;
    nodes[i] = square * kTriangles + (2 * p | (p ^ q));  // triangle_of(), in the width of the loop
  }
}

// Eq 14.
Label label_one(const Run& run, const LabelTile& tile, const std::uint32_t* nodes, std::size_t i,
                std::uint64_t& outside) {
  const LabelPlane& plane = tile.planes[nodes[i]];
  const std::int64_t dz = std::int64_t{run.z_mm[i]} - tile.centre_mm[nodes[i] / kTriangles];
  const float above = static_cast<float>(dz) - (plane.a * (0.5f * static_cast<float>(run.col.offset2[i])) +
                                                plane.b * (0.5f * static_cast<float>(run.row.offset2[i])));
  outside += plane.terrain == -INFINITY;
  return above < plane.below ? Label::kBelow : above <= plane.terrain ? Label::kTerrain : Label::kObstacle;
}

// The same for four points from i on, a lane each.
void label_four(const Run& run, const LabelTile& tile, const std::uint32_t* nodes, std::size_t i,
                std::uint64_t& outside, Label* labels) {
  const auto load = [](const std::int32_t* from) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)); };
  const auto plane = [&](std::size_t k) { return _mm_loadu_ps(&tile.planes[nodes[i + k]].a); };
  const auto centre = [&](std::size_t k) { return tile.centre_mm[nodes[i + k] / kTriangles]; };
  const auto all = [](Label l) { return _mm_set1_epi32(static_cast<std::int32_t>(l)); };
  __m128 a = plane(0), b = plane(1), terrain = plane(2), below = plane(3);
  _MM_TRANSPOSE4_PS(a, b, terrain, below);
  const __m128 half = _mm_set1_ps(0.5F);
  const __m128 x = _mm_mul_ps(half, _mm_cvtepi32_ps(load(run.col.offset2 + i)));
  const __m128 y = _mm_mul_ps(half, _mm_cvtepi32_ps(load(run.row.offset2 + i)));
  const __m128i dz = _mm_sub_epi32(load(run.z_mm + i), _mm_setr_epi32(centre(0), centre(1), centre(2), centre(3)));
  const __m128 above = _mm_sub_ps(_mm_cvtepi32_ps(dz), _mm_add_ps(_mm_mul_ps(a, x), _mm_mul_ps(b, y)));
  const auto mask = [](__m128 m) { return _mm_castps_si128(m); };
  __m128i label = _mm_blendv_epi8(all(Label::kObstacle), all(Label::kTerrain), mask(_mm_cmple_ps(above, terrain)));
  label = _mm_blendv_epi8(label, all(Label::kBelow), mask(_mm_cmplt_ps(above, below)));
  const std::int32_t bytes = _mm_cvtsi128_si32(_mm_packus_epi16(_mm_packs_epi32(label, label), label));
  std::memcpy(labels + i, &bytes, sizeof bytes);
  outside += static_cast<unsigned>(
      std::popcount(static_cast<unsigned>(_mm_movemask_ps(_mm_cmpeq_ps(terrain, _mm_set1_ps(-INFINITY))))));
}

void label_run(const Run& run, const LabelTile& tile, std::uint32_t* nodes, std::uint64_t& outside, Label* labels) {
  find_nodes(run, tile.box, nodes);
  std::size_t i = run.first;
  for (; i + 4 <= run.end; i += 4) label_four(run, tile, nodes, i, outside, labels);
  for (; i < run.end; ++i) labels[i] = label_one(run, tile, nodes, i, outside);
}

struct Scratch {
  PointBlock block;  // with its records
  Axis col, row;
  std::uint32_t nodes[kChunkPoints];
  std::vector<Label> labels;
  TileId tile_id{INT32_MIN, INT32_MIN};
  std::shared_ptr<const LabelTile> tile;  // the one the last point fell into
  LabelCounts counts;
};

// Points [at, at + n) of the block.
void label_chunk(Scratch& s, std::size_t at, std::size_t n, const MapLayout& layout, LabelTiles& tiles) {
  const std::int64_t *x_mm = s.block.x_mm.data() + at, *y_mm = s.block.y_mm.data() + at;
  const std::int32_t r_mm = layout.lattice.resolution_mm();
  const bool any_dropped = s.block.dropped() > 0;
  s.col.locate(x_mm, x_mm, n, any_dropped, r_mm);
  s.row.locate(y_mm, x_mm, n, any_dropped, r_mm);
  Label* labels = s.labels.data() + at;
  for (std::size_t i = 0; i < n;) {
    const Cell cell{s.col.cell[i], s.row.cell[i]};
    if (cell.col == Axis::kDropped) {
      labels[i++] = Label::kDropped;
      continue;
    }
    if (!s.tile || !s.tile->box.contains(cell)) {
      const TileId id = layout.grid.tile_of(cell);
      if (id != s.tile_id) {
        s.tile = tiles.get(id);
        s.tile_id = id;
      }
      if (!s.tile || !s.tile->box.contains(cell)) {
        labels[i++] = Label::kObstacle;
        ++s.counts.outside;
        continue;
      }
    }
    const Run run{s.col, s.row, s.block.z_mm.data() + at, i, end_inside(s.col, s.row, i, n, s.tile->box)};
    label_run(run, *s.tile, s.nodes, s.counts.outside, labels);
    i = run.end;
  }
}

BTMS_WIDE void count_labels(const std::vector<Label>& labels, LabelCounts& counts) {
  std::uint32_t of[4] = {};
  for (const Label l : labels) {
    of[0] += l == Label::kDropped;
    of[1] += l == Label::kTerrain;
    of[2] += l == Label::kObstacle;
    of[3] += l == Label::kBelow;
  }
  counts.dropped += of[0];
  counts.terrain += of[1];
  counts.obstacle += of[2];
  counts.below += of[3];
}

void label_block(Scratch& s, const MapLayout& layout, LabelTiles& tiles) {
  s.labels.resize(s.block.size());
  for (std::size_t at = 0; at < s.labels.size(); at += kChunkPoints)
    label_chunk(s, at, std::min(kChunkPoints, s.labels.size() - at), layout, tiles);
  count_labels(s.labels, s.counts);
}

}  // namespace

LabelCounts label_points(const PointSource& source, const TileSource& map, const Parameters& parameters,
                         const Threads& threads, const LabelConsumer& consumer, Progress& progress,
                         std::size_t cache_bytes) {
  LabelTiles tiles(map, parameters, cache_bytes);
  std::vector<Scratch> scratch(static_cast<std::size_t>(threads.count()));
  for (Scratch& s : scratch) s.block.keep_records = true;
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
    consumer(first, s.labels, s.block);
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
