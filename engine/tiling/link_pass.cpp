// Components of locally convex candidates (paper Eq 6 and B-TGS): inside every tile by union-find, over tile borders by
// merging pairs of component ids. A component's id is its smallest node key; ids exist only here.
#include <algorithm>
#include <unordered_map>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/components.h"
#include "engine/terrain/local_convexity.h"
#include "engine/tiling/merged_components.h"
#include "engine/tiling/passes.h"

namespace btms {
namespace {

constexpr NodeKey kNoComponent = ~NodeKey{0};

using Link = ComponentLink<NodeKey>;
struct ComponentSize {
  NodeKey id;
  std::uint64_t nodes = 0, passages = 0;
};

// Edges from the interior into the halo, as offsets into the node field.
struct BorderEdge {
  std::uint32_t inside, outside;
};

struct TileLinks {
  std::vector<ComponentSize> components;  // ascending by id
  std::vector<BorderEdge> border;
};

// Links the candidates of one tile; writes component ids of the interior.
void link_tile(const TileField<Node>& nodes, const ConvexityRules& rules, std::int32_t r_mm,
               std::span<const Passage> passed, TileField<NodeKey>& ids, TileLinks& out) {
  const CellBox& box = nodes.interior();
  const std::span<const Node> value = nodes.values();
  Components components(value.size());
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const std::size_t i = nodes.offset({col, row}) + t;
        const Node& a = value[i];
        if (a.node_class != NodeClass::kCandidate) continue;
        for (const NodeOffset& o : kNeighbourTable[t]) {
          const Cell cell{col + o.col, row + o.row};
          const std::size_t j = nodes.offset(cell) + o.triangle;
          const bool inside = box.contains(cell);
          if (inside && j < i) continue;  // every inner edge once
          const Node& b = value[j];
          if (b.node_class != NodeClass::kCandidate) continue;
          const Eigen::Vector3d d(o.col * r_mm + b.mean_x_mm - a.mean_x_mm, o.row * r_mm + b.mean_y_mm - a.mean_y_mm,
                                  static_cast<double>(b.mean_z_mm) - a.mean_z_mm);
          if (!locally_convex(a, b, d, rules)) continue;
          if (inside)
            components.unite(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
          else
            out.border.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
        }
      }

  // Ascending offsets are ascending keys inside a tile, so a component's root is its smallest key.
  std::unordered_map<std::uint32_t, std::size_t> index_of_root;
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const std::size_t i = nodes.offset({col, row}) + t;
        NodeKey& id = ids.values()[ids.offset({col, row}) + t];
        id = kNoComponent;
        if (value[i].node_class != NodeClass::kCandidate) continue;
        const std::uint32_t root = components.find(static_cast<std::uint32_t>(i));
        if (root == i) {
          index_of_root.emplace(root, out.components.size());
          out.components.push_back({node_key({{col, row}, t})});
        }
        ComponentSize& component = out.components[index_of_root.at(root)];
        id = component.id;
        ++component.nodes;
      }
  for (const Passage& p : passed) {
    const std::size_t i = nodes.offset(p.node.cell) + p.node.triangle;
    const Node& n = value[i];
    if (n.node_class != NodeClass::kCandidate) continue;
    const Eigen::Vector2d g = gradient_of(n);
    if (p.borne_by(n.mean_z_mm + g.x() * (p.dx_mm - n.mean_x_mm) + g.y() * (p.dy_mm - n.mean_y_mm)))
      ++out.components[index_of_root.at(components.find(static_cast<std::uint32_t>(i)))].passages;
  }
}

// Component id -> kept? Global and tiny: it sees only ids, sizes and links.
class Verdicts {
 public:
  Verdicts(const std::vector<ComponentSize>& components, const std::vector<Link>& links, std::uint64_t keep_nodes)
      : merged_(components, links), nodes_(merged_.size(), 0), passages_(merged_.size(), 0), keep_nodes_(keep_nodes) {
    for (const ComponentSize& c : components) {
      nodes_[merged_.root(c.id)] += c.nodes;
      passages_[merged_.root(c.id)] += c.passages;
    }
    for (std::size_t i = 0; i < merged_.size(); ++i)
      if (merged_.is_root(i)) ++counts_.all, counts_.kept += kept_at(i);
  }
  bool kept(NodeKey id) const { return kept_at(merged_.root(id)); }
  const ComponentCounts& counts() const { return counts_; }

 private:
  MergedComponents<NodeKey> merged_;
  bool kept_at(std::size_t root) const { return nodes_[root] >= keep_nodes_ || passages_[root] > 0; }

  std::vector<std::uint64_t> nodes_, passages_;  // of whole components, at their root
  std::uint64_t keep_nodes_;
  ComponentCounts counts_;
};

}  // namespace

ComponentCounts link_pass(const PassContext& context, NodeFields& nodes) {
  const auto& tiles = context.table.tiles();
  const ConvexityRules rules(context.parameters);
  const std::int32_t r_mm = resolution_mm(context.parameters);

  TileFields<NodeKey> ids(context.pager, tiles.size());
  std::vector<TileLinks> links(tiles.size());
  const PassagesByTile passed(context.trajectory, context.table);
  context.for_each_tile("link", {reads(nodes), writes(ids)}, [&](std::size_t i, int) {
    ids[i] = TileField<NodeKey>(tiles[i].box, kLinkHalo);
    link_tile(nodes[i], rules, r_mm, passed.of(i), ids[i], links[i]);
  });
  exchange_halo(context.table, ids, kLinkHalo, context.threads, context.ranks);

  // Both tiles of a border found its edges; that the pairs come twice does no harm.
  std::vector<ComponentSize> components;
  std::vector<Link> pairs;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (!context.owns(i)) continue;
    const InUse tile({reads(nodes), reads(ids)}, i);
    components.insert(components.end(), links[i].components.begin(), links[i].components.end());
    const auto id_at = [&](std::uint32_t node_offset) {
      const std::size_t cell = node_offset / kTriangles, cols = static_cast<std::size_t>(nodes[i].held().cols());
      const Cell c{nodes[i].held().col0 + static_cast<std::int32_t>(cell % cols),
                   nodes[i].held().row0 + static_cast<std::int32_t>(cell / cols)};
      return ids[i].cell(c)[node_offset % kTriangles];
    };
    for (const BorderEdge& e : links[i].border) pairs.push_back({id_at(e.inside), id_at(e.outside)});
  }
  sort_unique(pairs);

  const Verdicts verdicts(context.ranks.gather(components), context.ranks.gather(pairs),
                          static_cast<std::uint64_t>(context.parameters.keep_nodes));
  context.for_each_tile("merge", {writes(nodes), reads(ids)}, [&](std::size_t i, int) {
    const CellBox& box = tiles[i].box;
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col) {
        Node* node = nodes[i].cell({col, row});
        const NodeKey* id = ids[i].cell({col, row});
        for (int t = 0; t < kTriangles; ++t)
          if (id[t] != kNoComponent)
            node[t].node_class = verdicts.kept(id[t]) ? NodeClass::kTerrain : NodeClass::kRejected;
      }
  });
  return verdicts.counts();
}

}  // namespace btms
