// Components of locally convex candidates (paper Eq 6 and B-TGS): inside every tile by union-find, over tile borders by
// merging pairs of component ids. A component's id is its smallest node key; ids exist only here.
#include "engine/tiling/merged_components.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/tile_components.h"

namespace btms {
namespace {

constexpr NodeKey kNoComponent = ~NodeKey{0};

using Link = ComponentLink<NodeKey>;
struct ComponentSize {
  NodeKey id;
  std::uint64_t nodes = 0, passages = 0;
};

struct TileLinks {
  TileComponents found;
  std::vector<ComponentSize> components;

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    found.for_each_buffer(fn), fn(components);
  }
};

NodeId node_at(const TileField<Node>& nodes, std::size_t offset) {
  const std::size_t cell = offset / kTriangles, cols = static_cast<std::size_t>(nodes.held().cols());
  return {{nodes.held().col0 + static_cast<std::int32_t>(cell % cols),
           nodes.held().row0 + static_cast<std::int32_t>(cell / cols)},
          static_cast<std::uint8_t>(offset % kTriangles)};
}

// Links the candidates of one tile; writes component ids of the interior.
void link_tile(const TileField<Node>& nodes, const ConvexityRules& rules, std::int32_t r_mm,
               std::span<const Passage> passed, LinkScratch& scratch, TileField<NodeKey>& ids, TileLinks& out) {
  out.found.find(nodes, rules, r_mm, scratch);
  for (const TileComponents::Component& c : out.found.components())
    out.components.push_back({node_key(node_at(nodes, c.root)), c.nodes, 0});
  const CellBox& box = nodes.interior();
  for (std::int32_t row = box.row0; row < box.row1; ++row) {
    NodeKey* id = ids.cell({box.col0, row});
    const std::size_t begin = nodes.offset({box.col0, row});
    for (std::size_t i = 0; i < static_cast<std::size_t>(box.cols()) * kTriangles; ++i) {
      const std::uint32_t component = out.found.component_of(begin + i);
      id[i] = component == TileComponents::kNone ? kNoComponent : out.components[component].id;
    }
  }
  for (const Passage& p : passed) {
    const std::size_t i = nodes.offset(p.node.cell) + p.node.triangle;
    const Node& n = nodes.values()[i];
    if (n.node_class != NodeClass::kCandidate) continue;
    const Eigen::Vector2d g = gradient_of(n);
    if (p.borne_by(n.mean_z_mm + g.x() * (p.dx_mm - n.mean_x_mm) + g.y() * (p.dy_mm - n.mean_y_mm)))
      ++out.components[out.found.component_of(i)].passages;
  }
}

struct Members {
  std::uint64_t nodes = 0, passages = 0;
  friend bool operator==(const Members&, const Members&) = default;
  Members& operator+=(const Members& o) {
    nodes += o.nodes, passages += o.passages;
    return *this;
  }
};

// Component id -> kept? Sees only ids, sizes and links. Collective.
class Verdicts {
 public:
  Verdicts(const std::vector<ComponentSize>& components, const std::vector<Link>& links, std::uint64_t keep_nodes,
           Ranks& ranks)
      : merged_(components, links, {}, ranks), members_(merged_.size()), keep_nodes_(keep_nodes) {
    for (const ComponentSize& c : components) members_[merged_.whole(c.id)] += {c.nodes, c.passages};
    merged_.add_up(members_);
    std::uint64_t kept = 0;
    for (std::uint32_t i = merged_.first_to_count(); i < merged_.size(); ++i) kept += kept_at(i);
    const auto sums = ranks.sum<std::uint64_t>({merged_.size() - merged_.first_to_count(), kept});
    counts_ = {sums[0], sums[1]};
  }
  bool kept(NodeKey id) const { return kept_at(merged_.whole(id)); }
  const ComponentCounts& counts() const { return counts_; }

 private:
  bool kept_at(std::size_t i) const { return members_[i].nodes >= keep_nodes_ || members_[i].passages > 0; }

  MergedComponents<NodeKey> merged_;
  std::vector<Members> members_;
  std::uint64_t keep_nodes_;
  ComponentCounts counts_;
};

}  // namespace

ComponentCounts link_pass(const PassContext& context, NodeFields& nodes) {
  const auto& tiles = context.table.tiles();
  const ConvexityRules rules(context.parameters);
  const std::int32_t r_mm = resolution_mm(context.parameters);

  TileFields<NodeKey> ids(context.pager, tiles.size());
  Paged<TileLinks> links(context.pager, tiles.size());
  std::vector<LinkScratch> scratch(static_cast<std::size_t>(context.threads.count()));
  const PassagesByTile passed(context.trajectory, context.table);
  context.for_each_tile("link", {reads(nodes), writes(ids), writes(links)}, [&](std::size_t i, int worker) {
    ids[i] = TileField<NodeKey>(tiles[i].box, kLinkHalo);
    link_tile(nodes[i], rules, r_mm, passed.of(i), scratch[static_cast<std::size_t>(worker)], ids[i], links[i]);
  });
  exchange_halo(context.table, ids, kLinkHalo, context.threads, context.ranks);

  // Both tiles of a border found its edges; that the pairs come twice does no harm.
  std::vector<ComponentSize> components;
  std::vector<Link> pairs;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (!context.owns(i)) continue;
    const InUse tile({reads(nodes), reads(ids), reads(links)}, i);
    components.insert(components.end(), links[i].components.begin(), links[i].components.end());
    const auto id_at = [&](std::uint32_t offset) {
      const NodeId n = node_at(nodes[i], offset);
      return ids[i].cell(n.cell)[n.triangle];
    };
    for (const TileComponents::BorderEdge& e : links[i].found.border())
      pairs.push_back({id_at(e.inside), id_at(e.outside)});
  }
  sort_unique(pairs);

  const auto alone = single_rank();
  const bool pooled = context.ranks.tells_all(context.table.node_count());
  if (pooled) context.ranks.pool(components, pairs);
  const Verdicts verdicts(components, pairs, static_cast<std::uint64_t>(context.parameters.keep_nodes),
                          pooled ? *alone : context.ranks);
  context.for_each_tile("merge", {writes(nodes), reads(links)}, [&](std::size_t i, int) {
    std::vector<NodeClass> verdict;  // by component of the tile
    for (const ComponentSize& c : links[i].components)
      verdict.push_back(verdicts.kept(c.id) ? NodeClass::kTerrain : NodeClass::kRejected);
    judge(links[i].found, verdict, nodes[i]);
  });
  return verdicts.counts();
}

}  // namespace btms
