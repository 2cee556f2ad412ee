#include "engine/tiling/ordered_points.h"

#include <algorithm>
#include <bit>

#include "engine/error.h"
#include "engine/tiling/node_sort.h"

namespace btms {
namespace {

// Of equal heights whichever lies further west, then south: the choice depends on the set of points alone. Offsets from
// the square's centre are moved to 0 to 65535, so that one comparison of one word does: nobody can foretell it.
struct LowestPoint {
  std::int32_t x_mm, y_mm, z_mm;
};
LowestPoint lowest_of(const NodePoints& points) {
  std::int64_t lowest = INT64_MAX;
  for (std::size_t i = 0; i < points.size; ++i)
    lowest = std::min(lowest, points.z_mm[i] * (std::int64_t{1} << 32) +
                                  (points.x_mm[i] + 32768) * std::int64_t{65536} + (points.y_mm[i] + 32768));
  return {static_cast<std::int32_t>(lowest >> 16 & 0xffff) - 32768, static_cast<std::int32_t>(lowest & 0xffff) - 32768,
          static_cast<std::int32_t>(lowest >> 32)};
}

// The points of a bin that have just been sorted.
OrderedPoints::Bin copy_of(const NodeSort& sorted, std::size_t nodes, std::size_t n) {
  OrderedPoints::Bin bin;
  const NodePoints all = sorted.node(0);
  bin.x_mm.assign(all.x_mm, all.x_mm + n);
  bin.y_mm.assign(all.y_mm, all.y_mm + n);
  bin.z_mm.assign(all.z_mm, all.z_mm + n);
  bin.end.resize(nodes);
  std::uint32_t end = 0;
  for (std::size_t k = 0; k < nodes; ++k) bin.end[k] = end += static_cast<std::uint32_t>(sorted.node(k).size);
  return bin;
}

class LowestFinder {
 public:
  LowestFinder(const NodeOrder& order, const BinGrid& grid)
      : cells_(static_cast<std::uint32_t>(grid.edge_cells)),
        r_mm_(grid.lattice.resolution_mm()),
        row_by_row_(order.finest_nodes()) {
    const auto& numbers = order.numbers(order.refinements());
    for (std::size_t k = 0; k < numbers.size(); ++k) row_by_row_[numbers[k]] = static_cast<std::uint16_t>(k);
  }

  OrderedPoints::Lowest operator()(const OrderedPoints::Bin& bin) const {
    OrderedPoints::Lowest out;
    out.end.resize(row_by_row_.size());
    out.points.reserve(static_cast<std::size_t>(
        std::count_if(row_by_row_.begin(), row_by_row_.end(), [&](std::uint16_t k) { return bin.node(k).size > 0; })));
    for (std::size_t number = 0; number < row_by_row_.size(); ++number) {
      const std::size_t k = row_by_row_[number];
      const NodePoints points = bin.node(k);
      if (points.size > 0) {
        const LowestPoint low = lowest_of(points);
        const auto cell = static_cast<std::uint32_t>(k / kTriangles);
        const auto centre = [&](std::uint32_t i) { return static_cast<std::int32_t>(i) * r_mm_ + r_mm_ / 2; };
        out.points.push_back({static_cast<std::uint16_t>(centre(cell % cells_) + low.x_mm),
                              static_cast<std::uint16_t>(centre(cell / cells_) + low.y_mm), low.z_mm});
      }
      out.end[number] = static_cast<std::uint16_t>(out.points.size());
    }
    return out;
  }

 private:
  std::uint32_t cells_;
  std::int32_t r_mm_;
  std::vector<std::uint16_t> row_by_row_;  // by number: the node's place row by row
};

}  // namespace

OrderedPoints::OrderedPoints(PointBins&& from, const BinGrid& finest, const TileTable& tiles, const Threads& threads,
                             Pager& pager, Progress& progress)
    : pager_(&pager),
      order_(std::countr_zero(static_cast<std::uint32_t>(finest.edge_cells))),
      bins_(pager, from.size()),
      lowest_(pager, order_.refinements() > 0 ? from.size() : 0) {
  const BinGrid coarsest(tiles.layout().lattice, 1);
  for (std::size_t k = 0; k < from.size(); ++k) {
    const CellBox box = coarsest.box_of(from.id(k));
    const std::int32_t tile = tiles.index_of(tiles.layout().grid.tile_of({box.col0, box.row0}));
    places_.push_back({from.id(k), static_cast<std::uint32_t>(tile), static_cast<std::uint32_t>(k), from.points_in(k)});
    points_ += places_.back().points;
    if (places_.back().points > 0xffffffffu)
      throw Error(ErrorCode::kBadInput, "more than 4294967295 points in one block of " +
                                            std::to_string(finest.edge_mm() / 1000) + " m: thin the input");
  }
  std::stable_sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.tile < b.tile; });

  struct Scratch {
    NodeSort sort;
    PointBins::Scratch points;
  };
  std::vector<Scratch> scratch(static_cast<std::size_t>(threads.count()));
  const LowestFinder find_lowest(order_, finest);
  visit("sort", threads, progress, nullptr, [&](std::size_t i, int worker) {
    Scratch& s = scratch[static_cast<std::size_t>(worker)];
    from.take(places_[i].bin, s.points, [&](const PointBins::Bin& bin) { s.sort.sort(bin, finest); });
    const auto to = bins_.edit(i);
    *to = copy_of(s.sort, order_.finest_nodes(), static_cast<std::size_t>(places_[i].points));
    if (lowest_.size() > 0) *lowest_.edit(i) = find_lowest(*to);
  });
}

void OrderedPoints::for_each_bin(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
                                 const BinFn& fn) const {
  visit(phase, threads, progress, only,
        [&](std::size_t i, int worker) { fn(places_[i].tile, places_[i].id, *bins_.view(i), worker); });
}

void OrderedPoints::for_each_lowest(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
                                    const LowestFn& fn) const {
  visit(phase, threads, progress, only,
        [&](std::size_t i, int worker) { fn(places_[i].tile, places_[i].id, *lowest_.view(i), worker); });
}

// Every other time from the end: what was used last is in memory still.
void OrderedPoints::visit(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
                          const std::function<void(std::size_t, int)>& fn) const {
  const bool backwards = pager_->limited() && pager_->turn();
  std::vector<std::size_t> asked;
  std::uint64_t points = 0;
  for (std::size_t i = 0; i < places_.size(); ++i)
    if (!only || (*only)[places_[i].tile]) asked.push_back(i), points += places_[i].points;
  progress.begin(phase, points, "points");
  threads.for_each(asked.size(), [&](std::size_t k, int worker) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, std::string("stopped in ") + phase);
    const std::size_t i = asked[backwards ? asked.size() - 1 - k : k];
    fn(i, worker);
    progress.advance(places_[i].points);
  });
}

}  // namespace btms
