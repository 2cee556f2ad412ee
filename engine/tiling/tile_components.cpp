#include "engine/tiling/tile_components.h"

#include <cstring>

#include "engine/lattice/lanes.h"
#include "engine/lattice/neighbours.h"
#include "engine/lattice/wide.h"

namespace btms {
namespace {

constexpr std::size_t kPadding = kLanes;  // before and behind a row: lanes reach past its ends
struct Edge {
  std::uint8_t triangle;
  NodeOffset to;
};
// The edges from a square's triangles to neighbours with larger keys: every edge of the lattice once.
constexpr auto forward_edges() {
  std::array<Edge, kTriangles * kNeighbours / 2> edges{};
  std::size_t n = 0;
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (const NodeOffset& o : kNeighbourTable[t])
      if (o.row > 0 || (o.row == 0 && (o.col > 0 || (o.col == 0 && o.triangle > t)))) edges.at(n++) = {t, o};
  return edges;
}
constexpr auto kForwardEdges = forward_edges();

// `cells` points at the first of `n` squares.
void load_row(const Node* cells, std::size_t n, LinkRow& row) {
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    LinkRow::Column& c = row.triangle[t];
    const std::size_t size = n + 2 * kPadding;
    for (auto* v : {&c.normal_x, &c.normal_y, &c.normal_z, &c.mean_x, &c.mean_y, &c.mean_z}) v->resize(size);
    c.candidate.assign(size, 0);
    for (std::size_t i = 0; i < n; ++i) {
      const Node& node = cells[i * kTriangles + t];
      if (node.node_class != NodeClass::kCandidate) continue;
      const std::size_t to = kPadding + i;
      const Eigen::Vector3d normal = normal_of(node);
      c.candidate[to] = 1;
      c.normal_x[to] = normal.x();
      c.normal_y[to] = normal.y();
      c.normal_z[to] = normal.z();
      c.mean_x[to] = node.mean_x_mm;
      c.mean_y[to] = node.mean_y_mm;
      c.mean_z[to] = node.mean_z_mm;
    }
  }
}

struct Verdict {
  LongLanes convex, unsure;
};

// Eq 6 of four pairs. The sine is bounded by its series; pairs that fall between the bounds are left unsure.
BTMS_INLINE Verdict locally_convex(const LinkRow::Column& a, std::size_t i, const LinkRow::Column& b, std::size_t j,
                                   double offset_x, double offset_y, const ConvexityRules& rules) {
  const Lanes dx = offset_x + load_lanes(&b.mean_x[j]) - load_lanes(&a.mean_x[i]);
  const Lanes dy = offset_y + load_lanes(&b.mean_y[j]) - load_lanes(&a.mean_y[i]);
  const Lanes dz = load_lanes(&b.mean_z[j]) - load_lanes(&a.mean_z[i]);
  const Lanes ax = load_lanes(&a.normal_x[i]), ay = load_lanes(&a.normal_y[i]), az = load_lanes(&a.normal_z[i]);
  const Lanes bx = load_lanes(&b.normal_x[j]), by = load_lanes(&b.normal_y[j]), bz = load_lanes(&b.normal_z[j]);
  const Lanes distance = sqrt_lanes(dx * dx + dy * dy + dz * dz), reach = distance * rules.sine_plane_distance;
  const LongLanes flat =
      (abs_lanes(bx * dx + by * dy + bz * dz) <= reach) & (abs_lanes(ax * dx + ay * dy + az * dz) <= reach);
  const Lanes x = distance * rules.normal_similarity_per_mm, x2 = x * x;
  const Lanes above = x * (1.0 - x2 * ((1.0 / 6) - x2 * (1.0 / 120))), below = above - x * x2 * x2 * x2 * (1.0 / 5040);
  const Lanes missing = 1.0 - (ax * bx + ay * by + az * bz);  // similar where this is at most sin x
  constexpr double kMargin = 1e-9;
  const LongLanes small = x < 1.0, similar = small & (missing <= below - kMargin);
  const LongLanes unlike = small & (missing >= above + kMargin);
  return {flat & similar, flat & ~similar & ~unlike};
}

}  // namespace

BTMS_WIDE void TileComponents::find(const TileField<Node>& nodes, const ConvexityRules& rules, std::int32_t r_mm,
                                    LinkScratch& scratch) {
  auto& [rows, sets] = scratch;
  const CellBox& box = nodes.interior();
  const Node* const values = nodes.values().data();
  const CellBox ring = box.grown(1);
  const auto cols = static_cast<std::size_t>(ring.cols());
  sets.reset(nodes.values().size());
  border_.clear();

  load_row(nodes.cell({ring.col0, ring.row0}), cols, rows[0]);
  for (std::int32_t row = ring.row0; row < ring.row1; ++row) {
    const LinkRow& here = rows[static_cast<std::size_t>(row - ring.row0) % 2];
    LinkRow& north = rows[static_cast<std::size_t>(row - ring.row0 + 1) % 2];
    const bool last = row + 1 == ring.row1;
    if (!last) load_row(nodes.cell({ring.col0, row + 1}), cols, north);
    const std::size_t begin = nodes.offset({ring.col0, row});
    const auto inside = [&](std::int32_t of_row, std::size_t k) {
      return of_row >= box.row0 && of_row < box.row1 && k >= 1 && k + 1 < cols;
    };
    for (const auto& [t, o] : kForwardEdges) {
      if (last && o.row > 0) continue;
      const LinkRow::Column& a = here.triangle[t];
      const LinkRow::Column& b = (o.row == 0 ? here : north).triangle[o.triangle];
      const std::size_t step = nodes.offset({ring.col0 + o.col, row + o.row}) + o.triangle - begin - t;
      for (std::size_t k = 0; k < cols; k += kLanes) {
        const std::size_t i = kPadding + k, j = i + static_cast<std::size_t>(std::ptrdiff_t{o.col});
        std::uint32_t a_here, b_here;
        std::memcpy(&a_here, &a.candidate[i], sizeof a_here);
        std::memcpy(&b_here, &b.candidate[j], sizeof b_here);
        const std::uint32_t both = a_here & b_here;
        if (both == 0) continue;
        const double offset_x = o.col * r_mm, offset_y = o.row * r_mm;
        const Verdict verdict = locally_convex(a, i, b, j, offset_x, offset_y, rules);
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          if ((both >> (8 * lane) & 1) == 0) continue;
          const std::size_t from = begin + (k + lane) * kTriangles + t, to = from + step;
          if (!verdict.convex[lane]) {
            if (!verdict.unsure[lane]) continue;
            const Node &p = values[from], &q = values[to];
            const Eigen::Vector3d d(offset_x + q.mean_x_mm - p.mean_x_mm, offset_y + q.mean_y_mm - p.mean_y_mm,
                                    static_cast<double>(q.mean_z_mm) - p.mean_z_mm);
            if (!btms::locally_convex(p, q, d, rules)) continue;
          }
          const bool from_inside = inside(row, k + lane);
          const bool to_inside = inside(row + o.row, k + lane + static_cast<std::size_t>(std::ptrdiff_t{o.col}));
          const auto p = static_cast<std::uint32_t>(from), q = static_cast<std::uint32_t>(to);
          if (from_inside && to_inside)
            sets.unite(p, q);
          else if (from_inside)
            border_.push_back({p, q});
          else if (to_inside)
            border_.push_back({q, p});
        }
      }
    }
  }

  // Ascending offsets are ascending keys inside a tile, so a component's root is its smallest key, and comes first.
  components_.clear();
  component_of_.assign(nodes.values().size(), kNone);
  for (std::int32_t row = box.row0; row < box.row1; ++row) {
    const std::size_t begin = nodes.offset({box.col0, row});
    for (std::size_t i = begin; i < begin + static_cast<std::size_t>(box.cols()) * kTriangles; ++i) {
      if (values[i].node_class != NodeClass::kCandidate) continue;
      const std::uint32_t root = sets.find(static_cast<std::uint32_t>(i));
      if (root == i) {
        component_of_[i] = static_cast<std::uint32_t>(components_.size());
        components_.push_back({root, 0});
      } else {
        component_of_[i] = component_of_[root];
      }
      ++components_[component_of_[i]].nodes;
    }
  }
}

}  // namespace btms
