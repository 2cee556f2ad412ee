#include "io/export/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "engine/error.h"

namespace btms {
namespace {

constexpr std::int32_t kBlockEdge = 128;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// A corner of the mesh and what is around it.
struct Corner {
  std::int32_t z_mm = kUnknownHeight_mm;
  std::array<std::uint8_t, 5> around{};  // nodes of the map by state

  bool known() const { return z_mm != kUnknownHeight_mm; }
  NodeState state() const {
    std::size_t most = 1;
    for (std::size_t s = 2; s < around.size(); ++s)
      if (around[s] >= around[most]) most = s;
    return static_cast<NodeState>(most);
  }
};

// The squares of a block and one ring around them.
class Block {
 public:
  Block(int level, const CellBox& box) : level_(level), own_(box), held_(box.grown(1)) {
    const auto cells = static_cast<std::size_t>(held_.cells());
    corners_.resize(static_cast<std::size_t>((held_.rows() + 1) * (held_.cols() + 1)));
    centres_.resize(cells);
    masks_.resize(cells);
  }

  const CellBox& own() const { return own_; }

  void take(const TerrainTile& tile) {
    for_each_inside(tile, 0, static_cast<std::int32_t>(held_.cols()) + 1, static_cast<std::int32_t>(held_.rows()) + 1,
                    [&](std::size_t i, Cell at) { take_corner(tile, at, corners_[i]); });
    if (level_ > 0) {
      for_each_inside(tile, std::int64_t{1} << (level_ - 1), static_cast<std::int32_t>(held_.cols()),
                      static_cast<std::int32_t>(held_.rows()),
                      [&](std::size_t i, Cell at) { take_corner(tile, at, centres_[i]); });
      return;
    }
    const CellBox box = held_.intersect(tile.box);
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col) take_square(tile, {col, row});
  }

  // On coarser levels: where all corners are known there is a triangle.
  void finish() {
    if (level_ == 0) return;
    for_each_square(held_, [&](Cell c) {
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const auto [m, p, q] = corners_of(c, t);
        if (m->known() && p->known() && q->known()) masks_[square(c)] |= static_cast<std::uint8_t>(1 << t);
      }
    });
  }

  template <class Fn>
  static void for_each_square(const CellBox& box, const Fn& fn) {
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col) fn(Cell{col, row});
  }

  bool has(Cell c, std::uint8_t t) const { return (masks_[square(c)] >> t & 1) != 0; }
  const Corner& centre(Cell c) const { return centres_[square(c)]; }
  const Corner& corner(Cell c) const { return corners_[corner_index(c)]; }  // A of the square

  // Of the mean slope of the triangles of the mesh there are.
  std::array<float, 3> normal_at_centre(Cell c, double edge_mm) const {
    Slope sum;
    for (std::uint8_t t = 0; t < kTriangles; ++t) add_slope(c, t, sum);
    return sum.normal(edge_mm);
  }
  std::array<float, 3> normal_at_corner(Cell c, double edge_mm) const {
    Slope sum;
    const Cell around[] = {{c.col - 1, c.row - 1}, {c.col, c.row - 1}, {c.col - 1, c.row}, c};
    constexpr std::uint8_t kTouching[][2] = {{kEast, kNorth}, {kNorth, kWest}, {kEast, kSouth}, {kWest, kSouth}};
    for (std::size_t i = 0; i < 4; ++i)
      for (const std::uint8_t t : kTouching[i]) add_slope(around[i], t, sum);
    return sum.normal(edge_mm);
  }

 private:
  struct Slope {
    std::int64_t east_mm = 0, north_mm = 0;  // rises over an edge
    int triangles = 0;

    std::array<float, 3> normal(double edge_mm) const {
      if (triangles == 0) return {0, 0, 1};
      const double e = static_cast<double>(east_mm) / (edge_mm * triangles),
                   n = static_cast<double>(north_mm) / (edge_mm * triangles), length = std::sqrt(e * e + n * n + 1);
      return {static_cast<float>(-e / length), static_cast<float>(-n / length), static_cast<float>(1 / length)};
    }
  };

  std::size_t square(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - held_.row0) * held_.cols() + (c.col - held_.col0));
  }
  std::size_t corner_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - held_.row0) * (held_.cols() + 1) + (c.col - held_.col0));
  }
  std::array<const Corner*, 3> corners_of(Cell c, std::uint8_t t) const {
    const auto rel = triangle_corners(t);
    const auto at = [&](HalfCell h) { return &corners_[corner_index({c.col + h.x / 2, c.row + h.y / 2})]; };
    return {&centres_[square(c)], at(rel[1]), at(rel[2])};
  }

  void add_slope(Cell c, std::uint8_t t, Slope& sum) const {
    if (!has(c, t)) return;
    const auto [m, p, q] = corners_of(c, t);
    const std::int64_t out = std::int64_t{p->z_mm} + q->z_mm - 2 * std::int64_t{m->z_mm},
                       along = std::int64_t{q->z_mm} - p->z_mm;
    const std::int64_t east[] = {out, -along, -out, along}, north[] = {along, out, -along, -out};
    sum.east_mm += east[t];
    sum.north_mm += north[t];
    ++sum.triangles;
  }

  // fn(index, corner of the map) of those of cols x rows corners, `shift` squares of the map from the corners A, that
  // touch a square of the tile.
  template <class Fn>
  void for_each_inside(const TerrainTile& tile, std::int64_t shift, std::int32_t cols, std::int32_t rows,
                       const Fn& fn) const {
    const std::int64_t step = std::int64_t{1} << level_;
    const auto first = [&](std::int32_t from, std::int32_t low) {  // least i with (from + i) * step + shift >= low
      return std::max<std::int64_t>(0, -floor_div(-(low - shift - from * step), step));
    };
    const auto last = [&](std::int32_t from, std::int32_t high, std::int32_t n) {
      return std::min<std::int64_t>(n - 1, floor_div(high - shift - from * step, step));
    };
    const CellBox& b = tile.box;
    for (std::int64_t j = first(held_.row0, b.row0); j <= last(held_.row0, b.row1, rows); ++j)
      for (std::int64_t i = first(held_.col0, b.col0); i <= last(held_.col0, b.col1, cols); ++i)
        fn(static_cast<std::size_t>(j * cols + i), Cell{static_cast<std::int32_t>((held_.col0 + i) * step + shift),
                                                        static_cast<std::int32_t>((held_.row0 + j) * step + shift)});
  }

  // What the tile's squares around a corner of the map say of it.
  static void take_corner(const TerrainTile& tile, Cell at, Corner& corner) {
    const Cell around[] = {{at.col - 1, at.row - 1}, {at.col, at.row - 1}, {at.col - 1, at.row}, at};
    constexpr std::uint8_t kTouching[][2] = {{kEast, kNorth}, {kNorth, kWest}, {kEast, kSouth}, {kWest, kSouth}};
    for (std::size_t i = 0; i < 4; ++i) {
      if (!tile.box.contains(around[i])) continue;
      for (const std::uint8_t t : kTouching[i]) {
        const NodeState state = tile.nodes[tile.node_index({around[i], t})].state;
        if (state == NodeState::kUnknown) continue;
        ++corner.around[static_cast<std::size_t>(state)];
        corner.z_mm = tile.corner_mm[tile.corner_index(at)];
      }
    }
  }

  void take_square(const TerrainTile& tile, Cell c) {
    Corner& centre = centres_[square(c)];
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const NodeState state = tile.nodes[tile.node_index({c, t})].state;
      if (state == NodeState::kUnknown) continue;
      ++centre.around[static_cast<std::size_t>(state)];
      centre.z_mm = tile.centre_mm[tile.cell_index(c)];
      masks_[square(c)] |= static_cast<std::uint8_t>(1 << t);
    }
  }

  const int level_;
  const CellBox own_, held_;
  std::vector<Corner> corners_, centres_;
  std::vector<std::uint8_t> masks_;  // bit t: there is triangle t
};

// A tile that a block, or the ring around it, touches.
struct Use {
  std::int32_t row = 0, col = 0;  // of blocks
  TileId tile;
  friend auto operator<=>(const Use& a, const Use& b) {
    return std::tie(a.row, a.col, a.tile) <=> std::tie(b.row, b.col, b.tile);
  }
};

CellBox block_box(const Use& use, const CellBox& box) {
  const std::int32_t col = use.col * kBlockEdge, row = use.row * kBlockEdge;
  return CellBox{col, row, col + kBlockEdge, row + kBlockEdge}.intersect(box);
}

// In the order of the walk.
std::vector<Use> uses_of(const TileSource& map, int level, const CellBox& box) {
  const auto squares = [&](std::int32_t v) {
    return static_cast<std::int32_t>(floor_div(v, std::int64_t{1} << level));
  };
  std::vector<Use> uses;
  for (const TileId tile : map.tiles()) {
    const CellBox fine = map.layout().grid.box_of(tile);
    // One square more than it covers on every side.
    const CellBox reach =
        CellBox{squares(fine.col0), squares(fine.row0), squares(fine.col1 - 1) + 1, squares(fine.row1 - 1) + 1}
            .grown(1)
            .intersect(box.grown(1));
    if (reach.empty()) continue;
    const auto block = [](std::int32_t v) { return static_cast<std::int32_t>(floor_div(v, kBlockEdge)); };
    for (std::int32_t row = block(reach.row0); row <= block(reach.row1 - 1); ++row)
      for (std::int32_t col = block(reach.col0); col <= block(reach.col1 - 1); ++col)
        if (const Use use{row, col, tile}; !block_box(use, box).empty()) uses.push_back(use);
  }
  std::sort(uses.begin(), uses.end());
  return uses;
}

// Numbers vertices as they are first used. Corners on the northern and eastern sides of blocks are remembered for the
// blocks there.
class Numbering {
 public:
  Numbering(int level, std::int32_t resolution_mm, const MeshSink& sink)
      : edge_mm_(std::int64_t{resolution_mm} << level), sink_(sink) {}

  void emit(const Use& where, const Block& block) {
    begin(where, block.own());
    Block::for_each_square(block.own(), [&](Cell c) {
      std::uint32_t centre = kNone;
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        if (!block.has(c, t)) continue;
        if (centre == kNone)
          centre = add(block.centre(c), 2 * std::int64_t{c.col} + 1, 2 * std::int64_t{c.row} + 1,
                       block.normal_at_centre(c, static_cast<double>(edge_mm_)));
        const auto rel = triangle_corners(t);
        const auto id = [&](HalfCell h) { return corner_id(block, {c.col + h.x / 2, c.row + h.y / 2}); };
        const std::uint32_t p = id(rel[1]), q = id(rel[2]);
        triangles_.push_back({centre, p, q});
      }
    });
    end();
    if (!triangles_.empty()) sink_(vertices_, triangles_);
    vertices_.clear();
    triangles_.clear();
  }

 private:
  void begin(const Use& where, const CellBox& box) {
    if (where.row != row_) {
      south_.clear();
      if (where.row == row_ + 1) south_.swap(north_);
      north_.clear();
    }
    const bool adjoins = where.row == row_ && where.col == col_ + 1;
    row_ = where.row;
    col_ = where.col;
    const std::vector<std::uint32_t> west = adjoins ? east_side() : std::vector<std::uint32_t>{};
    box_ = box;
    ids_.assign(static_cast<std::size_t>((box.cols() + 1) * (box.rows() + 1)), kNone);
    for (std::int32_t row = box.row0; row <= box.row1 && adjoins; ++row)
      ids_[index({box.col0, row})] = west[static_cast<std::size_t>(row - box.row0)];
    for (std::int32_t col = box.col0; col <= box.col1; ++col)
      if (const auto it = south_.find(col); it != south_.end()) ids_[index({col, box.row0})] = it->second;
  }
  std::vector<std::uint32_t> east_side() const {
    std::vector<std::uint32_t> ids;
    for (std::int32_t row = box_.row0; row <= box_.row1; ++row) ids.push_back(ids_[index({box_.col1, row})]);
    return ids;
  }
  void end() {
    for (std::int32_t col = box_.col0; col <= box_.col1; ++col)
      if (const std::uint32_t id = ids_[index({col, box_.row1})]; id != kNone) north_[col] = id;
  }

  std::size_t index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box_.row0) * (box_.cols() + 1) + (c.col - box_.col0));
  }
  std::uint32_t corner_id(const Block& block, Cell c) {
    std::uint32_t& id = ids_[index(c)];
    if (id == kNone)
      id = add(block.corner(c), 2 * std::int64_t{c.col}, 2 * std::int64_t{c.row},
               block.normal_at_corner(c, static_cast<double>(edge_mm_)));
    return id;
  }
  std::uint32_t add(const Corner& corner, std::int64_t x_halves, std::int64_t y_halves,
                    const std::array<float, 3>& normal) {
    if (next_ == std::numeric_limits<std::int32_t>::max())
      throw Error(ErrorCode::kUsage, "more than 2^31 vertices; ask for a part (--bbox) or a coarser --level");
    vertices_.push_back({x_halves * edge_mm_ / 2, y_halves * edge_mm_ / 2, corner.z_mm, normal, corner.state()});
    return next_++;
  }

  const std::int64_t edge_mm_;
  const MeshSink& sink_;
  std::int32_t row_ = std::numeric_limits<std::int32_t>::min(), col_ = row_;
  CellBox box_;
  std::vector<std::uint32_t> ids_;                                 // of the block's corners
  std::unordered_map<std::int32_t, std::uint32_t> south_, north_;  // by column: of the corners along a row of blocks
  std::vector<MeshVertex> vertices_;
  std::vector<MeshTriangle> triangles_;
  std::uint32_t next_ = 0;
};

}  // namespace

void walk_surface(const TileSource& map, int level, const CellBox& box, const MeshSink& sink) {
  const std::vector<Use> uses = uses_of(map, level, box);
  Numbering numbering(level, map.layout().lattice.resolution_mm(), sink);
  for (std::size_t i = 0; i < uses.size();) {
    Block block(level, block_box(uses[i], box));
    const Use where = uses[i];
    for (; i < uses.size() && uses[i].row == where.row && uses[i].col == where.col; ++i)
      if (const auto tile = map.load(uses[i].tile)) block.take(*tile);
    block.finish();
    numbering.emit(where, block);
  }
}

MeshSize measure_surface(const TileSource& map, int level, const CellBox& box) {
  MeshSize size;
  walk_surface(map, level, box, [&](std::span<const MeshVertex> vertices, std::span<const MeshTriangle> triangles) {
    for (const MeshVertex& v : vertices) {
      const std::array<std::int64_t, 3> at = {v.x_mm, v.y_mm, v.z_mm};
      for (std::size_t i = 0; i < 3; ++i) {
        size.min_mm[i] = size.vertices == 0 ? at[i] : std::min(size.min_mm[i], at[i]);
        size.max_mm[i] = size.vertices == 0 ? at[i] : std::max(size.max_mm[i], at[i]);
      }
      ++size.vertices;
    }
    size.triangles += triangles.size();
  });
  if (size.triangles == 0) throw Error(ErrorCode::kUsage, "there is no surface in the box");
  return size;
}

}  // namespace btms
