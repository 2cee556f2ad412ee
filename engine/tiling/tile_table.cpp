#include "engine/tiling/tile_table.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "engine/error.h"

namespace btms {
namespace {

std::string metres(std::int64_t mm) { return std::to_string(mm / 1000); }

// Positions inside a tile and its halo are 32-bit millimetres, and squares are counted exactly in float.
std::int64_t widest_tile_cells(std::int32_t r_mm, std::int32_t reach) {
  return std::min<std::int64_t>(1 << 21, INT32_MAX / r_mm - 2 * std::int64_t{reach} - 64);
}

// What a finest cell costs beside its points, in points: measured, 4 us against 27 ns.
constexpr std::uint64_t kPointsPerCell = 150;

// Position of column x, row y along a Hilbert curve.
std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y) {
  std::uint64_t index = 0;
  for (int bit = 31; bit >= 0; --bit) {
    const std::uint32_t right = (x >> bit) & 1u, upper = (y >> bit) & 1u;
    index = index << 2 | ((3 * right) ^ upper);
    if (upper) continue;  // the lower quadrants are turned
    if (right) x = ~x, y = ~y;
    std::swap(x, y);
  }
  return index;
}

// The bin furthest from the median of all bins: the likely culprit of an absurd extent.
BinId furthest(std::span<const BinId> bins) {
  std::vector<std::int32_t> xs, ys;
  for (const BinId& b : bins) xs.push_back(b.bx), ys.push_back(b.by);
  const auto middle = static_cast<std::ptrdiff_t>((bins.size() - 1) / 2);
  std::nth_element(xs.begin(), xs.begin() + middle, xs.end());
  std::nth_element(ys.begin(), ys.begin() + middle, ys.end());
  const std::int64_t mx = xs[static_cast<std::size_t>(middle)], my = ys[static_cast<std::size_t>(middle)];
  const auto away = [&](const BinId& b) { return std::max(std::abs(b.bx - mx), std::abs(b.by - my)); };
  return *std::max_element(bins.begin(), bins.end(), [&](const BinId& a, const BinId& b) { return away(a) < away(b); });
}

}  // namespace

TileTable::TileTable(std::span<const BinId> occupied, const BinGrid& bins, std::int32_t tile_cells, std::int32_t reach,
                     std::uint64_t max_nodes, int refinements)
    : bins_(bins), layout_{bins.lattice, {}}, refinements_(refinements) {
  const std::int64_t widest = widest_tile_cells(bins.lattice.resolution_mm(), reach);
  if (tile_cells < 0 || tile_cells > widest)
    throw Error(ErrorCode::kUsage, "a tile edge of " + std::to_string(tile_cells) + " cells: expected 1 to " +
                                       std::to_string(widest) + ", or 0 for the whole map");
  if (tile_cells > 0) {
    layout_.grid.edge_cells = tile_cells;
  } else {
    CellBox whole;
    for (const BinId& b : occupied) whole = whole.hull(bins.box_of(b));
    whole = whole.grown(reach);
    layout_.grid.origin = {whole.col0, whole.row0};
    layout_.grid.edge_cells = static_cast<std::int32_t>(std::min(std::max(whole.cols(), whole.rows()), widest));
  }

  const auto nodes_of = [&](const CellBox& box) {
    return (static_cast<std::uint64_t>(box.grown(reach).cells()) * kTriangles) << (2 * refinements);
  };
  const auto refuse = [&](const std::string& nodes) {
    const BinId far = furthest(occupied);
    const std::int64_t edge = bins.edge_mm();
    throw Error(ErrorCode::kUsage, "the map would hold " + nodes + " nodes (halos included), more than --max-nodes " +
                                       std::to_string(max_nodes) + "; the points furthest out are near x = " +
                                       metres(far.bx * edge) + " m, y = " + metres(far.by * edge) +
                                       " m: remove them, choose a coarser --resolution, or raise --max-nodes");
  };

  // Points strewn over a continent: one bin of each tile is too much already, and all of them would fill the memory.
  {
    std::vector<std::pair<TileId, std::uint64_t>> tiles;
    for (const BinId& b : occupied) {
      const CellBox box = bins.box_of(b);
      const TileId id = layout_.grid.tile_of({box.col0, box.row0});
      if (tiles.empty() || tiles.back().first != id)
        tiles.emplace_back(id, nodes_of(box.intersect(layout_.grid.box_of(id))));
    }
    std::sort(tiles.begin(), tiles.end());
    std::uint64_t at_least = 0;
    for (std::size_t i = 0; i < tiles.size(); ++i)
      if (i == 0 || tiles[i].first != tiles[i - 1].first) at_least += tiles[i].second;
    if (at_least > max_nodes) refuse("at least " + std::to_string(at_least));
  }

  // Cells with points per tile, then what predictions from them may reach.
  std::map<TileId, CellBox> with_points, in_use;
  for (const BinId& b : occupied) {
    const CellBox box = bins.box_of(b);
    layout_.grid.for_each_tile(box, [&](TileId id) {
      CellBox& hull = with_points[id];
      hull = hull.hull(box.intersect(layout_.grid.box_of(id)));
    });
  }
  for (const auto& [source, box] : with_points) {
    const CellBox reached = box.grown(reach);
    layout_.grid.for_each_tile(reached, [&](TileId id) {
      CellBox& hull = in_use[id];
      hull = hull.hull(reached.intersect(layout_.grid.box_of(id)));
    });
  }

  std::uint64_t nodes = 0, largest = 0;
  for (const auto& [id, box] : in_use) {
    const std::uint64_t held = nodes_of(box);
    nodes += held;
    largest = std::max(largest, held);
    index_.emplace(id, static_cast<std::int32_t>(tiles_.size()));
    tiles_.push_back({id, box});
  }
  // Nodes of one tile are counted in 32 bits.
  if (nodes > max_nodes || largest > UINT32_MAX) refuse(std::to_string(nodes));
}

TileTable TileTable::finer() const {
  TileTable t = *this;
  --t.refinements_;
  t.layout_.lattice = layout_.lattice.finer();
  t.layout_.grid.edge_cells *= 2;
  t.layout_.grid.origin = {layout_.grid.origin.col * 2, layout_.grid.origin.row * 2};
  for (Tile& tile : t.tiles_) tile.box = {tile.box.col0 * 2, tile.box.row0 * 2, tile.box.col1 * 2, tile.box.row1 * 2};
  return t;
}

std::uint64_t TileTable::node_count() const {
  std::uint64_t nodes = 0;
  for (const Tile& tile : tiles_) nodes += static_cast<std::uint64_t>(tile.box.cells()) * kTriangles;
  return nodes;
}

std::int32_t TileTable::tile_of(BinId bin) const {
  const CellBox box = bins_.box_of(bin);
  return index_of(layout_.grid.tile_of({box.col0, box.row0}));
}

void TileTable::share_out(std::span<const OccupiedBin> occupied, int ranks) {
  const TileGrid finest{static_cast<std::int32_t>(
                            std::min<std::int64_t>(std::int64_t{layout_.grid.edge_cells} << refinements_, INT32_MAX)),
                        {}};
  TileId corner{INT32_MAX, INT32_MAX};
  for (const Tile& tile : tiles_) {
    const TileId block = block_of(finest, tile.id);
    corner = {std::min(corner.tx, block.tx), std::min(corner.ty, block.ty)};
  }
  const auto place = [&](const Tile& tile) {
    const TileId block = block_of(finest, tile.id);
    return hilbert_index(static_cast<std::uint32_t>(block.tx) - static_cast<std::uint32_t>(corner.tx),
                         static_cast<std::uint32_t>(block.ty) - static_cast<std::uint32_t>(corner.ty));
  };
  std::map<std::uint64_t, std::uint64_t> work_along_curve;  // of blocks
  std::uint64_t work = 0;
  const auto add = [&](const Tile& tile, std::uint64_t more) {
    work_along_curve[place(tile)] += more;
    work += more;
  };
  for (const Tile& tile : tiles_)
    add(tile, (static_cast<std::uint64_t>(tile.box.cells()) << (2 * refinements_)) * kPointsPerCell);
  for (const OccupiedBin& bin : occupied)
    if (const std::int32_t i = tile_of(bin.id); i >= 0) add(tiles_[static_cast<std::size_t>(i)], bin.points);

  // A block goes to the rank that the middle of its work falls to.
  std::map<std::uint64_t, int> owner;
  double before = 0;
  for (const auto& [at, here] : work_along_curve) {
    const double middle = before + static_cast<double>(here) / 2;
    owner[at] = std::min(static_cast<int>(middle / static_cast<double>(work) * ranks), ranks - 1);
    before += static_cast<double>(here);
  }
  for (Tile& tile : tiles_) tile.owner = owner[place(tile)];
}

}  // namespace btms
