// Walks over the points of a level, node by node.
#pragma once

#include <vector>

#include "engine/error.h"
#include "engine/terrain/level_fit.h"
#include "engine/tiling/node_sort.h"
#include "engine/tiling/passes.h"

namespace btms {

template <class Fn>
void for_each_cell(const CellBox& box, const Fn& fn) {
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) fn(Cell{col, row});
}

template <class Fn>
void for_each_node(const CellBox& box, const Fn& fn) {
  for_each_cell(box, [&](Cell c) {
    for (std::uint8_t t = 0; t < kTriangles; ++t) fn(NodeId{c, t});
  });
}

// Calls fn(tile, cell, points of its four nodes, worker) for every square with points. Bins lie inside tiles (both are
// cut at multiples of the coarsest cell), and calls for one bin come from one thread.
template <class Fn>
void for_each_square_with_points(const PassContext& context, const char* phase, const PointBins& bins,
                                 const BinGrid& grid, const Fn& fn) {
  std::vector<NodeSort> sorts(static_cast<std::size_t>(context.threads.count()));
  context.progress.begin(phase, bins.counts().points, "points");
  context.threads.for_each(bins.bins().size(), [&](std::size_t k, int worker) {
    if (context.progress.stop_requested()) throw Error(ErrorCode::kCancelled, std::string("stopped in ") + phase);
    const PointBins::Bin& bin = bins.bins()[k];
    NodeSort& sort = sorts[static_cast<std::size_t>(worker)];
    sort.sort(bin, grid);
    const CellBox box = grid.box_of(bin.id);
    const std::int32_t tile = context.table.index_of(context.table.layout().grid.tile_of({box.col0, box.row0}));
    std::size_t at = 0;
    for_each_cell(box, [&](Cell c) {
      SquarePoints points;
      std::size_t all = 0;
      for (NodePoints& p : points) p = sort.node(at++), all += p.size;
      if (all > 0) fn(static_cast<std::size_t>(tile), c, points, worker);
    });
    context.progress.advance(bin.size);
  });
}

// The same node by node: fn(tile, node, points).
template <class Fn>
void for_each_node_with_points(const PassContext& context, const char* phase, const PointBins& bins,
                               const BinGrid& grid, const Fn& fn) {
  for_each_square_with_points(context, phase, bins, grid,
                              [&](std::size_t tile, Cell c, const SquarePoints& points, int) {
                                for (std::uint8_t t = 0; t < kTriangles; ++t)
                                  if (points[t].size > 0) fn(tile, NodeId{c, t}, points[t]);
                              });
}

}  // namespace btms
