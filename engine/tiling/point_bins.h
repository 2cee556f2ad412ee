// Pass "partition": reads the sources in parallel blocks, rounds nothing (readers did), and sorts the points by bin.
//
// A bin is a block of b x b cells (b a power of two, at most 32 cells and 65.5 m), anchored at absolute multiples of b:
// its points fit the cache while they are sorted by node, and a point needs 8 bytes. Bins know nothing of tiles.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/point_source.h"
#include "engine/tiling/progress.h"

namespace btms {

// Position of a bin: index of its south-west corner in units of b cells.
struct BinId {
  std::int32_t bx = 0, by = 0;
  friend constexpr auto operator<=>(const BinId& a, const BinId& b) {
    return a.by != b.by ? a.by <=> b.by : a.bx <=> b.bx;
  }
  friend constexpr bool operator==(const BinId&, const BinId&) = default;
};

struct BinGrid {
  Lattice lattice;
  std::int32_t edge_cells;  // b

  explicit BinGrid(const Lattice& l);
  BinGrid(const Lattice& l, std::int32_t cells) : lattice(l), edge_cells(cells) {}
  std::int32_t edge_mm() const { return edge_cells * lattice.resolution_mm(); }
  CellBox box_of(BinId id) const {
    return {id.bx * edge_cells, id.by * edge_cells, (id.bx + 1) * edge_cells, (id.by + 1) * edge_cells};
  }
};

// A point in flight: offset from its bin's south-west corner, absolute height.
struct BinnedPoint {
  std::uint16_t x_mm, y_mm;
  std::int32_t z_mm;
};
static_assert(sizeof(BinnedPoint) == 8);

// Points grouped by bin: every bin is a list of runs, in no particular order.
class PointBins {
 public:
  struct Run {
    BinId bin;
    const BinnedPoint* points;
    std::uint32_t size;
  };
  struct Bin {
    BinId id;
    std::uint64_t size;
    std::span<const Run> runs;
  };
  struct Counts {
    std::uint64_t points = 0, not_finite = 0, out_of_range = 0;
  };

  // Reads this rank's share of the sources (every size()-th block).
  static PointBins read(std::span<const PointSource* const> sources, const BinGrid& grid, const Threads& threads,
                        const Ranks& ranks, Progress& progress);
  // Sends every bin to the rank owner(bin) names. Collective.
  template <class Owner>
  void redistribute(Ranks& ranks, const Owner& owner) {
    if (ranks.size() == 1) return;
    std::vector<Bytes> out(static_cast<std::size_t>(ranks.size()));
    for (const Run& run : runs_) append(out[static_cast<std::size_t>(owner(run.bin))], run);
    receive(ranks.exchange(std::move(out)));
  }

  // Ascending by id.
  const std::vector<Bin>& bins() const { return bins_; }
  const Counts& counts() const { return counts_; }

 private:
  static void append(Bytes& out, const Run& run);
  void receive(std::vector<Bytes> in);
  void group();

  std::vector<std::unique_ptr<BinnedPoint[]>> blocks_;
  std::vector<Bytes> received_;
  std::vector<Run> runs_;  // ascending by bin
  std::vector<Bin> bins_;
  Counts counts_;
};

}  // namespace btms
