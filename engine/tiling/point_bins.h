// Pass "partition": reads the sources in parallel blocks, rounds nothing (readers did), and sorts the points by bin.
//
// A bin is a block of b x b cells (b a power of two, at most 32 cells and 65.5 m), anchored at absolute multiples of b:
// its points fit the cache while they are sorted by node, and a point needs 8 bytes. Bins know nothing of tiles.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/pager.h"
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

struct OccupiedBin {
  BinId id;
  std::uint64_t points;
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

// Points grouped by bin: every bin is a list of runs, in no particular order. Blocks of runs lie in memory as far as
// the budget goes, and in the spill beyond it.
class PointBins {
 public:
  struct Run {
    const BinnedPoint* points;
    std::uint32_t size;
  };
  // The points of a bin, in memory.
  struct Bin {
    BinId id;
    std::uint64_t size;
    std::span<const Run> runs;
  };
  struct Counts {
    std::uint64_t points = 0, not_finite = 0, out_of_range = 0, outside_box = 0;
  };
  struct Scratch {
    std::vector<Run> runs;
    std::vector<BinnedPoint> spilled;
  };

  PointBins() = default;
  PointBins(PointBins&& o) noexcept;
  PointBins& operator=(PointBins&&) = delete;
  ~PointBins();
  // Reads this rank's share of the sources (every size()-th block). `pager` outlives the bins.
  static PointBins read(std::span<const PointSource* const> sources, const BinGrid& grid, const Threads& threads,
                        const Ranks& ranks, Pager& pager, Progress& progress);
  // Sends every bin to the rank owner(bin) names, some at a time. Collective.
  template <class Owner>
  void redistribute(Ranks& ranks, const Owner& owner) {
    if (ranks.size() == 1) return;
    Received received;
    Scratch scratch;
    std::size_t k = 0;
    for (bool more = true; more;) {
      std::vector<Bytes> out(static_cast<std::size_t>(ranks.size()));
      for (std::uint64_t bytes = 0; k < size() && bytes < ranks.message_bytes(); ++k)
        take(k, scratch, [&](const Bin& bin) {
          append(out[static_cast<std::size_t>(owner(bin.id))], bin);
          bytes += bin.size * sizeof(BinnedPoint);
        });
      for (Bytes& bytes : out) bytes.push_back(k < size());
      std::vector<Bytes> in = ranks.exchange(std::move(out));
      more = false;
      for (Bytes& bytes : in) {
        more = more || bytes.back() != 0;
        bytes.pop_back();
      }
      receive(std::move(in), received);
    }
    blocks_ = std::move(received.blocks);
    pieces_ = std::move(received.pieces);
    group();
  }

  // Bins with points, ascending by id.
  std::size_t size() const { return first_piece_.size(); }
  BinId id(std::size_t k) const { return pieces_[first_piece_[k]].bin; }
  std::uint64_t points_in(std::size_t k) const;
  const Counts& counts() const { return counts_; }
  // Forgets the points of these bins (ascending); those not held here are passed over.
  void drop(std::span<const BinId> bins);

  // Calls fn(bin) with the points of bin k, which are gone afterwards: a block whose points have all been taken is
  // freed. Thread-safe for different bins and scratches.
  template <class Fn>
  void take(std::size_t k, Scratch& scratch, const Fn& fn) {
    fn(load(k, scratch));
    let_go(k);
  }

 private:
  struct Block {
    std::unique_ptr<BinnedPoint[]> points;  // nullptr: spilled
    std::uint64_t bytes = 0;                // claimed from the budget, or spilled
    Spill::Extent where;
    std::atomic<std::uint32_t> left = 0;  // points not taken yet
  };
  // A run inside a block.
  struct Piece {
    BinId bin;
    std::uint32_t block, first, size;
  };

  void keep(std::unique_ptr<BinnedPoint[]> points, std::size_t n, Block& block);
  Bin load(std::size_t k, Scratch& scratch) const;
  void let_go(std::size_t k);
  void discard(Block& block);
  static void append(Bytes& out, const Bin& bin);
  struct Received {
    std::vector<std::unique_ptr<Block>> blocks;
    std::vector<Piece> pieces;
  };
  void receive(const std::vector<Bytes>& in, Received& received);
  void group();
  std::span<const Piece> pieces(std::size_t k) const;

  Pager* pager_ = nullptr;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<Piece> pieces_;             // ascending by bin
  std::vector<std::size_t> first_piece_;  // of every bin
  Counts counts_;
  std::unique_ptr<Pager::Claim> listed_;  // what the pieces take
};

}  // namespace btms
