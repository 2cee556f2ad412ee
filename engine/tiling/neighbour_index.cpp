#include "engine/tiling/neighbour_index.h"

#include <cmath>
#include <nanoflann.hpp>

namespace btms {
namespace {

// Square centres in half cells from the held box's corner: small odd integers, exact in float.
struct SquareCloud {
  std::vector<Cell> squares;
  Cell origin;

  float coordinate(std::size_t i, std::size_t axis) const {
    return static_cast<float>(axis == 0 ? 2 * (squares[i].col - origin.col) + 1
                                        : 2 * (squares[i].row - origin.row) + 1);
  }
  std::size_t kdtree_get_point_count() const { return squares.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const { return coordinate(i, axis); }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

class NanoflannIndex final : public NeighbourIndex {
 public:
  NanoflannIndex(SquareCloud cloud, double reach_cells, std::int32_t group)
      : cloud_(std::move(cloud)), group_(group), tree_(2, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(kLeaf)) {
    // From the middle of the group: a centroid lies within group r / sqrt(2) of it, a mean within r / sqrt(2) of its
    // square's centre.
    const double radius = 2 * reach_cells + (group + 1) * std::sqrt(2.0) + 0.01;
    radius2_ = static_cast<float>(radius * radius);
  }

  void near(Cell corner, std::vector<Cell>& squares) override {
    squares.clear();
    if (cloud_.squares.empty()) return;
    const float middle[2] = {static_cast<float>(2 * (corner.col - cloud_.origin.col) + group_),
                             static_cast<float>(2 * (corner.row - cloud_.origin.row) + group_)};
    tree_.radiusSearch(middle, radius2_, found_, nanoflann::SearchParams(0, 0, false));
    for (const auto& [i, distance2] : found_) squares.push_back(cloud_.squares[i]);
  }

 private:
  static constexpr std::size_t kLeaf = 32;
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, SquareCloud>, SquareCloud, 2,
                                                   std::uint32_t>;
  SquareCloud cloud_;  // the tree refers to it
  std::int32_t group_;
  Tree tree_;  // built by its constructor
  float radius2_;
  std::vector<std::pair<std::uint32_t, float>> found_;
};

class LatticeIndex final : public NeighbourIndex {
 public:
  LatticeIndex(const CellBox& held, const std::vector<std::uint8_t>& wanted, std::int32_t rings, std::int32_t group)
      : held_(held), wanted_(wanted), rings_(rings), group_(group) {}

  void near(Cell corner, std::vector<Cell>& squares) override {
    squares.clear();
    const CellBox box =
        CellBox{corner.col, corner.row, corner.col + group_, corner.row + group_}.grown(rings_).intersect(held_);
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col)
        if (wanted_[static_cast<std::size_t>((std::int64_t{row} - held_.row0) * held_.cols() + (col - held_.col0))])
          squares.push_back({col, row});
  }

 private:
  CellBox held_;
  const std::vector<std::uint8_t>& wanted_;
  std::int32_t rings_, group_;
};

}  // namespace

std::unique_ptr<NeighbourIndex> nanoflann_index(const CellBox& held, const std::vector<std::uint8_t>& wanted,
                                                double reach_cells, std::int32_t group) {
  SquareCloud cloud;
  cloud.origin = {held.col0, held.row0};
  std::size_t k = 0;
  for (std::int32_t row = held.row0; row < held.row1; ++row)
    for (std::int32_t col = held.col0; col < held.col1; ++col)
      if (wanted[k++]) cloud.squares.push_back({col, row});
  return std::make_unique<NanoflannIndex>(std::move(cloud), reach_cells, group);
}

std::unique_ptr<NeighbourIndex> lattice_index(const CellBox& held, const std::vector<std::uint8_t>& wanted,
                                              std::int32_t reach_rings, std::int32_t group) {
  return std::make_unique<LatticeIndex>(held, wanted, reach_rings, group);
}

}  // namespace btms
