#include "engine/model/difference.h"

#include <algorithm>
#include <cstdlib>
#include <span>

namespace btms {
namespace {

struct NodeView {
  NodeSurface surface;
  std::array<std::int32_t, 3> corners_mm{kUnknownHeight_mm, kUnknownHeight_mm, kUnknownHeight_mm};
  std::span<const UpperNode> upper;

  bool has_surface() const { return surface.state != NodeState::kUnknown; }
  bool has_anything() const { return surface != NodeSurface{} || !upper.empty(); }
};

NodeView view(const TerrainTile* tile, NodeId id) {
  NodeView v;
  if (!tile || !tile->box.contains(id.cell)) return v;
  const std::size_t index = tile->node_index(id);
  v.surface = tile->nodes[index];
  if (v.has_surface()) v.corners_mm = tile->corners_mm(id);
  const auto range =
      std::equal_range(tile->upper.begin(), tile->upper.end(), UpperNode{.node = static_cast<std::uint32_t>(index)},
                       [](const UpperNode& a, const UpperNode& b) { return a.node < b.node; });
  v.upper = {range.first, range.second};
  return v;
}

class Comparison {
 public:
  explicit Comparison(Difference& sum) : sum_(sum) {}

  void add(const NodeView& a, const NodeView& b) {
    if (!a.has_anything() && !b.has_anything()) return;
    ++sum_.nodes;
    ++sum_.states[static_cast<std::size_t>(a.surface.state)][static_cast<std::size_t>(b.surface.state)];
    differs_ = a.surface.state != b.surface.state;
    number(CompareLayer::kCount, a.surface.count, b.surface.count);
    upper(a.upper, b.upper);
    if (a.has_surface() && b.has_surface()) surfaces(a, b);
    sum_.differ += differs_;
  }

 private:
  void surfaces(const NodeView& a, const NodeView& b) {
    std::uint64_t height_mm = 0;
    for (std::size_t i = 0; i < a.corners_mm.size(); ++i)
      height_mm = std::max(height_mm, distance(a.corners_mm[i], b.corners_mm[i]));
    if (height_mm > 0) note(CompareLayer::kHeight, height_mm, true);
    const NodeSurface &p = a.surface, &q = b.surface;
    number(CompareLayer::kWeight, p.weight, q.weight);
    number(CompareLayer::kSupport, p.support, q.support);
    number(CompareLayer::kSd, p.sd_mm, q.sd_mm);
    number(CompareLayer::kTerrain, p.terrain_mm, q.terrain_mm);
    number(CompareLayer::kRoughness, p.roughness_mm, q.roughness_mm);
    number(CompareLayer::kStep, p.step_mm, q.step_mm);
    number(CompareLayer::kClearance, p.clearance_mm, q.clearance_mm, kNothingAbove);
    number(CompareLayer::kCost, p.cost, q.cost, kNotTraversable);
    number(CompareLayer::kSourceLevel, p.source_level, q.source_level);
  }

  void upper(std::span<const UpperNode> a, std::span<const UpperNode> b) {
    const bool as_many = a.size() == b.size();
    bool same = as_many;
    std::uint64_t height_mm = 0;
    for (std::size_t i = 0; as_many && i < a.size(); ++i) {
      UpperNode p = a[i], q = b[i];
      height_mm = std::max(height_mm, distance(p.z_mm, q.z_mm));
      p.node = q.node = 0;  // counted in their tiles
      same = same && p == q;
    }
    if (!same) note(CompareLayer::kUpper, height_mm, as_many);
  }

  // `nothing` is no number: it differs, but by nothing that can be measured.
  void number(CompareLayer layer, std::int64_t a, std::int64_t b, std::int64_t nothing = -1) {
    if (a != b) note(layer, distance(a, b), a != nothing && b != nothing);
  }

  static std::uint64_t distance(std::int64_t a, std::int64_t b) { return static_cast<std::uint64_t>(std::abs(a - b)); }

  void note(CompareLayer layer, std::uint64_t by, bool measured) {
    differs_ = true;
    LayerDifference& l = sum_.layers[static_cast<std::size_t>(layer)];
    ++l.nodes;
    if (!measured) return;
    ++l.measured;
    l.sum += by;
    l.most = std::max(l.most, by);
  }

  Difference& sum_;
  bool differs_ = false;
};

}  // namespace

Difference& Difference::operator+=(const Difference& o) {
  nodes += o.nodes;
  differ += o.differ;
  for (std::size_t l = 0; l < kCompareLayers; ++l) {
    layers[l].nodes += o.layers[l].nodes;
    layers[l].measured += o.layers[l].measured;
    layers[l].sum += o.layers[l].sum;
    layers[l].most = std::max(layers[l].most, o.layers[l].most);
  }
  for (std::size_t from = 0; from < kStates; ++from)
    for (std::size_t to = 0; to < kStates; ++to) states[from][to] += o.states[from][to];
  return *this;
}

Difference difference(const TerrainTile* before, const TerrainTile* after, const CellBox& region) {
  const CellBox box = (before ? before->box : CellBox{}).hull(after ? after->box : CellBox{}).intersect(region);
  Difference sum;
  Comparison comparison(sum);
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        comparison.add(view(before, id), view(after, id));
      }
  return sum;
}

}  // namespace btms
