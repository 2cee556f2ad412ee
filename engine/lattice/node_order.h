// An order of the nodes of a square block of cells in which the nodes of every coarser lattice are contiguous: every
// triangle lies in exactly one of the lattice with twice the edge, so a node's number is that of its parent times four
// plus its place among its siblings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/lattice/lattice.h"

namespace btms {

// For blocks of 2^refinements x 2^refinements cells of the finest lattice, which are one cell of the coarsest.
class NodeOrder {
 public:
  explicit NodeOrder(int refinements) : numbers_(static_cast<std::size_t>(refinements) + 1) {
    numbers_[0] = {0, 1, 2, 3};
    for (int depth = 1; depth <= refinements; ++depth) {
      const std::vector<std::uint16_t>& coarse = numbers_[static_cast<std::size_t>(depth) - 1];
      std::vector<std::uint16_t>& fine = numbers_[static_cast<std::size_t>(depth)];
      std::vector<std::uint8_t> siblings(coarse.size(), 0);
      const std::int32_t edge = 1 << depth;
      for (std::int32_t row = 0; row < edge; ++row)
        for (std::int32_t col = 0; col < edge; ++col)
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            const NodeId above = parent({{col, row}, t});
            const std::size_t k =
                static_cast<std::size_t>(above.cell.row * (edge / 2) + above.cell.col) * kTriangles + above.triangle;
            fine.push_back(static_cast<std::uint16_t>(coarse[k] * 4 + siblings[k]++));
          }
    }
  }

  int refinements() const { return static_cast<int>(numbers_.size()) - 1; }
  // Numbers of the nodes of the lattice `depth` refinements below the coarsest, listed row by row, cell by cell,
  // triangle by triangle. Node number k holds the finest nodes [k 4^d, (k + 1) 4^d), d = refinements() - depth.
  const std::vector<std::uint16_t>& numbers(int depth) const { return numbers_[static_cast<std::size_t>(depth)]; }
  std::size_t finest_nodes() const { return numbers_.back().size(); }

 private:
  std::vector<std::vector<std::uint16_t>> numbers_;  // 2^16 are enough: at most 5 refinements
};

}  // namespace btms
