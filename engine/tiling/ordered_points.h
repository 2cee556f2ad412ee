// The points of a coarse-to-fine build, sorted once: by node of the finest lattice. Also what the coarser levels see of
// them: the lowest point of each finest node, in an order in which the nodes of every level are contiguous.
//
// The lowest of a node's points is all that levels above it need to find the ground from: measured, accuracy is that of
// all points (docs/accuracy.md), at a tenth of the work.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/lattice/node_order.h"
#include "engine/terrain/node_model.h"
#include "engine/tiling/paged.h"
#include "engine/tiling/point_bins.h"
#include "engine/tiling/tile_changes.h"
#include "engine/tiling/tile_table.h"

namespace btms {

// Thread-safe to read.
class OrderedPoints {
 public:
  // All points of a bin, by node: row by row, cell by cell, triangle by triangle.
  struct Bin {
    std::vector<std::int16_t> x_mm, y_mm;  // from the square's centre
    std::vector<std::int32_t> z_mm;
    std::vector<std::uint32_t> end;  // per node: where its points end

    NodePoints node(std::size_t k) const {
      const std::uint32_t begin = k == 0 ? 0 : end[k - 1];
      return {x_mm.data() + begin, y_mm.data() + begin, z_mm.data() + begin, end[k] - begin};
    }
    template <class Fn>
    void for_each_buffer(const Fn& fn) {
      fn(x_mm), fn(y_mm), fn(z_mm), fn(end);
    }
  };
  // The lowest point of every node that has any, in the order of NodeOrder.
  struct Lowest {
    std::vector<BinnedPoint> points;
    std::vector<std::uint16_t> end;  // per node number

    template <class Fn>
    void for_each_buffer(const Fn& fn) {
      fn(points), fn(end);
    }
  };

  // Takes the points out of `bins`, each one cell of the coarsest lattice; `finest` divides them. `tiles` and `pager`
  // outlive the points.
  OrderedPoints(PointBins&& bins, const BinGrid& finest, const TileTable& tiles, const Threads& threads, Pager& pager,
                Progress& progress);

  const NodeOrder& order() const { return order_; }
  std::uint64_t points() const { return points_; }

  // Calls fn(tile, position of the bin, points, worker) for every bin with points. `only`: those of these tiles.
  using BinFn = std::function<void(std::size_t, BinId, const Bin&, int)>;
  using LowestFn = std::function<void(std::size_t, BinId, const Lowest&, int)>;
  void for_each_bin(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
                    const BinFn& fn) const;
  void for_each_lowest(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
                       const LowestFn& fn) const;

 private:
  struct Place {
    BinId id;
    std::uint32_t tile;
    std::uint32_t bin;  // in the PointBins
    std::uint64_t points;
  };
  void visit(const char* phase, const Threads& threads, Progress& progress, const TileSet* only,
             const std::function<void(std::size_t, int)>& fn) const;

  Pager* pager_;
  NodeOrder order_;
  std::vector<Place> places_;  // tile by tile
  Paged<Bin> bins_;
  Paged<Lowest> lowest_;  // empty where there is one level
  std::uint64_t points_ = 0;
};

}  // namespace btms
