// Links, rims and verdicts of one round of a level (steps 5 and 6 of the coarse-to-fine method).
#include <algorithm>
#include <tuple>
#include <utility>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/components.h"
#include "engine/terrain/level_links.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/merged_components.h"

namespace btms {
namespace {

constexpr NodeKey kNoComponent = ~NodeKey{0};
enum EdgeKind : std::uint8_t { kLevelEdge = 0, kUpEdge = 1, kDownEdge = 2, kAgreeEdge = 3 };

struct Component {
  NodeKey id;
  ComponentSums sums;
};
using Link = ComponentLink<NodeKey>;
// Edges of one kind between two components; kUpEdge: a stands above b.
struct RimEdge {
  NodeKey a, b;
  std::uint64_t kind;
  std::uint64_t count;
  friend bool operator<(const RimEdge& x, const RimEdge& y) {
    return std::tie(x.a, x.b, x.kind) < std::tie(y.a, y.b, y.kind);
  }
  bool same(const RimEdge& o) const { return a == o.a && b == o.b && kind == o.kind; }
};

struct TileLinks {
  std::vector<Component> components;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> links;  // over the border, as offsets into the node field
};

// Calls fn(i, j, o, inside) for every pair of neighbours with a plane: node i of the interior, node j at offset o from
// it. Pairs inside the interior come once, i < j; pairs over the border whichever is the smaller.
template <class Fn>
void for_each_edge(const TileField<LevelNode>& nodes, const Fn& fn) {
  const std::span<const LevelNode> value = nodes.values();
  const CellBox &box = nodes.interior(), core = box.grown(-1);
  const auto cols = static_cast<std::int32_t>(nodes.held().cols());
  for_each_cell(box, [&](Cell c) {
    const bool at_border = !core.contains(c);
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const auto i = static_cast<std::uint32_t>(nodes.offset(c) + t);
      if (!value[i].has_plane()) continue;
      for (const NodeOffset& o : kNeighbourTable[t]) {
        const auto j = static_cast<std::uint32_t>(static_cast<std::int32_t>(i) + (o.row * cols + o.col) * kTriangles +
                                                  o.triangle - t);
        const bool inside = !at_border || box.contains({c.col + o.col, c.row + o.row});
        if ((inside && j < i) || !value[j].has_plane()) continue;
        fn(i, j, o, inside);
      }
    }
  });
}

LevelEdge edge_between(const LevelNode& a, const LevelNode& b, const NodeOffset& o, const LevelRules& rules) {
  return compare(a, b, o.col * rules.r_mm(), o.row * rules.r_mm(), rules);
}

void link_tile(const TileField<LevelNode>& nodes, const LevelRules& rules, std::span<const Passage> passed,
               TileField<NodeKey>& ids, TileLinks& out) {
  const CellBox& box = nodes.interior();
  const std::span<const LevelNode> value = nodes.values();
  Components components(value.size());
  for_each_edge(nodes, [&](std::uint32_t i, std::uint32_t j, const NodeOffset& o, bool inside) {
    if (value[i].level_class != value[j].level_class) return;
    if (inside && components.find(i) == components.find(j)) return;  // tells nothing
    if (!edge_between(value[i], value[j], o, rules).linked) return;
    if (inside)
      components.unite(i, j);
    else
      out.links.emplace_back(i, j);
  });

  std::vector<std::uint32_t> index(value.size());
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const auto i = static_cast<std::uint32_t>(nodes.offset({col, row}) + t);
        NodeKey& id = ids.cell({col, row})[t];
        id = kNoComponent;
        if (!value[i].has_plane()) continue;
        const std::uint32_t root = components.find(i);
        if (root == i) {
          index[i] = static_cast<std::uint32_t>(out.components.size());
          out.components.push_back({node_key({{col, row}, t}), {}});
          out.components.back().sums.above = value[i].level_class == LevelClass::kAbove;
        }
        Component& c = out.components[index[root]];
        id = c.id;
        ++c.sums.nodes;
        c.sums.above_mm += value[i].above_prior_mm;
        c.sums.tolerance_mm += value[i].tolerance_mm;
        for (const NodeOffset& o : kNeighbourTable[t])
          c.sums.open += !value[nodes.offset({col + o.col, row + o.row}) + o.triangle].has_plane();
      }
  for (const Passage& p : passed) {
    const auto i = static_cast<std::uint32_t>(nodes.offset(p.node.cell) + p.node.triangle);
    const LevelNode& n = value[i];
    const double x = p.dx_mm - n.mean_x_mm, y = p.dy_mm - n.mean_y_mm;
    if (n.has_plane() && p.borne_by(n.mean_z_mm + (n.slope_x * x + n.slope_y * y) / kSlopeUnit))
      ++out.components[index[components.find(i)]].sums.passages;
  }
}

// The rims of the components of a tile: edges inside, and over the border where ours is the smaller key (ascending
// offsets are ascending keys, in the halo too).
std::vector<RimEdge> rim_edges(const TileField<LevelNode>& nodes, const LevelRules& rules,
                               const TileField<NodeKey>& ids) {
  const std::span<const LevelNode> value = nodes.values();
  const std::span<const NodeKey> id = ids.values();
  std::vector<RimEdge> edges;
  for_each_edge(nodes, [&](std::uint32_t i, std::uint32_t j, const NodeOffset& o, bool) {
    if (j < i || id[i] == id[j]) return;
    const LevelEdge edge = edge_between(value[i], value[j], o, rules);
    if (edge.linked && value[i].level_class != value[j].level_class) edges.push_back({id[i], id[j], kAgreeEdge, 1});
    edges.push_back({id[i], id[j], edge.step > 0 ? kUpEdge : edge.step < 0 ? kDownEdge : kLevelEdge, 1});
  });
  return edges;
}

std::vector<RimEdge> counted(std::vector<RimEdge> edges) {
  std::sort(edges.begin(), edges.end());
  std::vector<RimEdge> out;
  for (const RimEdge& e : edges)
    if (!out.empty() && out.back().same(e))
      out.back().count += e.count;
    else
      out.push_back(e);
  return out;
}

// Global and small: sees components and counts only.
class Verdicts {
 public:
  Verdicts(const std::vector<Component>& components, const std::vector<Link>& links, const std::vector<RimEdge>& edges,
           const LevelRules& rules)
      : merged_(components, links), rejected_(merged_.size(), 0) {
    std::vector<ComponentSums> sums(merged_.size());
    for (const Component& c : components) {
      ComponentSums& s = sums[merged_.root(c.id)];
      s.nodes += c.sums.nodes;
      s.above_mm += c.sums.above_mm;
      s.tolerance_mm += c.sums.tolerance_mm;
      s.passages += c.sums.passages;
      s.open += c.sums.open;
      s.above = c.sums.above;
    }
    // Judged with all components standing, like the first round: what is gone says nothing about walls.
    const std::vector<std::uint8_t> on_island = rules.first() ? rejected_ : on_rejected_islands(sums, edges);
    std::vector<RimCounts> rims(merged_.size());
    for (int round = 0; round < rules.p().rejection_rounds; ++round) {
      rims.assign(merged_.size(), RimCounts{});
      for (const RimEdge& e : edges) {
        const std::uint32_t a = merged_.root(e.a), b = merged_.root(e.b);
        if (a == b) continue;
        count(rims[a], sums[a], sums[b], rejected_[b], e, e.kind == kUpEdge);
        count(rims[b], sums[b], sums[a], rejected_[a], e, e.kind == kDownEdge);
      }
      bool changed = false;
      const std::vector<std::uint8_t> before = rejected_;
      for (std::size_t i = 0; i < merged_.size(); ++i)
        if (merged_.is_root(i) && !before[i] && (on_island[i] || rejected(sums[i], rims[i], rules)))
          rejected_[i] = 1, changed = true;
      if (!changed) break;
    }
    for (std::size_t i = 0; i < merged_.size(); ++i)
      if (merged_.is_root(i)) ++counts_.all, counts_.kept += !rejected_[i];
  }
  bool is_rejected(NodeKey id) const { return rejected_[merged_.root(id)] != 0; }
  const ComponentCounts& counts() const { return counts_; }

 private:
  // One kind of edge as `mine` sees it, towards `other`. An edge up counts only against a component at least as large:
  // nothing is a roof because of a pit beside it.
  static void count(RimCounts& rim, const ComponentSums& mine, const ComponentSums& other, bool other_rejected,
                    const RimEdge& e, bool up) {
    if (other_rejected) return;
    if (e.kind == kAgreeEdge) {
      rim.agree += e.count;
      return;
    }
    if (up && other.nodes < mine.nodes) return;
    rim.rim += e.count;
    if (up) rim.up += e.count;
  }
  // Which components go with their whole island.
  std::vector<std::uint8_t> on_rejected_islands(const std::vector<ComponentSums>& sums,
                                                const std::vector<RimEdge>& edges) const {
    Components islands(merged_.size());
    for (const RimEdge& e : edges)
      if (e.kind == kAgreeEdge) islands.unite(merged_.root(e.a), merged_.root(e.b));
    std::vector<ComponentSums> whole(merged_.size());
    const auto island = [&](std::size_t i) { return islands.find(static_cast<std::uint32_t>(i)); };
    for (std::size_t i = 0; i < merged_.size(); ++i) {
      whole[island(i)].nodes += sums[i].nodes;
      whole[island(i)].open += sums[i].open;
      whole[island(i)].passages += sums[i].passages;
    }
    std::vector<RimCounts> rims(merged_.size());
    for (const RimEdge& e : edges) {
      const std::uint32_t a = island(merged_.root(e.a)), b = island(merged_.root(e.b));
      if (a == b) continue;
      count(rims[a], whole[a], whole[b], false, e, e.kind == kUpEdge);
      count(rims[b], whole[b], whole[a], false, e, e.kind == kDownEdge);
    }
    std::vector<std::uint8_t> out(merged_.size());
    for (std::size_t i = 0; i < merged_.size(); ++i) out[i] = rejected_island(whole[island(i)], rims[island(i)]);
    return out;
  }
  MergedComponents<NodeKey> merged_;
  std::vector<std::uint8_t> rejected_;
  ComponentCounts counts_;
};

}  // namespace

ComponentCounts judge_level(const PassContext& context, const LevelRules& rules, TileFields<LevelNode>& nodes) {
  const auto& tiles = context.table.tiles();
  TileFields<NodeKey> ids(context.pager, tiles.size());
  std::vector<TileLinks> tile_links(tiles.size());
  const PassagesByTile passed(context.trajectory, context.table);
  context.for_each_tile("link", {reads(nodes), writes(ids)}, [&](std::size_t i, int) {
    ids[i] = TileField<NodeKey>(nodes[i].interior(), nodes[i].halo());  // the same offsets
    link_tile(nodes[i], rules, passed.of(i), ids[i], tile_links[i]);
  });
  exchange_halo(context.table, ids, kLinkHalo, context.threads, context.ranks);

  std::vector<std::vector<RimEdge>> tile_edges(tiles.size());
  std::vector<std::vector<Link>> tile_pairs(tiles.size());
  context.for_each_tile("rim", {reads(nodes), reads(ids)}, [&](std::size_t i, int) {
    const std::span<const NodeKey> id = std::as_const(ids[i]).values();
    for (const auto& [a, b] : tile_links[i].links) tile_pairs[i].push_back({id[a], id[b]});
    sort_unique(tile_pairs[i]);
    tile_edges[i] = counted(rim_edges(nodes[i], rules, ids[i]));
  });

  std::vector<std::vector<Component>> components(tiles.size());
  for (std::size_t i = 0; i < tiles.size(); ++i) components[i] = std::move(tile_links[i].components);
  const Verdicts verdicts(gather_all(context.ranks, components), gather_all(context.ranks, tile_pairs),
                          gather_all(context.ranks, tile_edges), rules);
  context.for_each_tile("verdict", {writes(nodes), reads(ids)}, [&](std::size_t i, int) {
    const CellBox& box = tiles[i].box;
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col) {
        LevelNode* node = nodes[i].cell({col, row});
        const NodeKey* id = ids[i].cell({col, row});
        for (int t = 0; t < kTriangles; ++t)
          if (id[t] != kNoComponent && verdicts.is_rejected(id[t])) node[t].level_class = LevelClass::kRejected;
      }
  });
  return verdicts.counts();
}

}  // namespace btms
