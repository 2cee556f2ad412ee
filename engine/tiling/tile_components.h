// The connected components of one tile's candidates (paper Eq 6 and B-TGS), and the edges that leave it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/terrain/components.h"
#include "engine/terrain/local_convexity.h"
#include "engine/terrain/node.h"
#include "engine/tiling/tile_field.h"

namespace btms {

// One row of nodes, structure of arrays by triangle, so that four squares are compared at once.
struct LinkRow {
  struct Column {
    std::vector<double> normal_x, normal_y, normal_z, mean_x, mean_y, mean_z;
    std::vector<std::uint8_t> candidate;
  };
  std::array<Column, kTriangles> triangle;
};
// Reusable memory of TileComponents::find(), one a worker.
struct LinkScratch {
  std::array<LinkRow, 2> rows;
  Components sets;
};

// Nodes are named by their offset in the tile's field.
class TileComponents {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  struct Component {
    std::uint32_t root;  // its smallest node
    std::uint32_t nodes;
  };
  // From the interior into the halo.
  struct BorderEdge {
    std::uint32_t inside, outside;
  };

  // Links the candidates of the interior with one another, and with those of the innermost ring of the halo.
  void find(const TileField<Node>& nodes, const ConvexityRules& rules, std::int32_t r_mm, LinkScratch& scratch);

  std::span<const Component> components() const { return components_; }  // ascending by root
  std::span<const BorderEdge> border() const { return border_; }
  // Index of the component of an interior node, kNone where it is no candidate.
  std::uint32_t component_of(std::size_t node) const { return component_of_[node]; }

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(component_of_), fn(components_), fn(border_);
  }

 private:
  std::vector<std::uint32_t> component_of_;
  std::vector<Component> components_;
  std::vector<BorderEdge> border_;
};

// Gives every candidate of the interior what its component was found to be.
inline void judge(const TileComponents& found, std::span<const NodeClass> verdict, TileField<Node>& nodes) {
  const CellBox& box = nodes.interior();
  for (std::int32_t row = box.row0; row < box.row1; ++row) {
    const std::size_t begin = nodes.offset({box.col0, row});
    for (std::size_t i = begin; i < begin + static_cast<std::size_t>(box.cols()) * kTriangles; ++i)
      if (const std::uint32_t c = found.component_of(i); c != TileComponents::kNone)
        nodes.values()[i].node_class = verdict[c];
  }
}

}  // namespace btms
