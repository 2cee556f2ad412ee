// Links and rims of one round of a level (steps 5 and 6 of the coarse-to-fine method), and what follows from the
// verdicts on them.
#include <algorithm>
#include <array>
#include <bit>
#include <tuple>
#include <utility>

#include "engine/terrain/components.h"
#include "engine/terrain/level_edges.h"
#include "engine/terrain/level_links.h"
#include "engine/tiling/level_nodes.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/level_verdicts.h"
#include "engine/tiling/merged_components.h"

namespace btms {
namespace {

constexpr NodeKey kNoComponent = ~NodeKey{0};
struct BorderLink {
  std::uint32_t inside, outside;  // offsets into the node field
};
struct TileLinks {
  std::vector<LevelComponent> components;
  std::vector<BorderLink> links;    // over the border
  std::vector<ForwardEdges> edges;  // of the nodes of the interior

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(components), fn(links), fn(edges);
  }
};

// What a tile contributes to the verdicts.
struct TileRims {
  std::vector<LevelComponent> components;
  std::vector<LevelLink> pairs;
  std::vector<RimEdge> edges;

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(components), fn(pairs), fn(edges);
  }
};

// In the order of the region.
std::vector<ForwardEdges> edges_of(const TileField<LevelNode>& nodes, const LevelRegion& region,
                                   const LevelRules& rules) {
  const EdgeRules compared(rules);
  std::vector<ForwardEdges> edges(region.square_count() * kTriangles);
  NodeRow here, north;
  LevelRegion::Run before{};
  std::size_t at = 0;
  for (const LevelRegion::Run& run : region.squares()) {
    // With a square at either end.
    const auto row_of = [&](std::int32_t row) {
      return nodes.values().subspan(nodes.offset({run.col0 - 1, row}),
                                    static_cast<std::size_t>(run.col1 - run.col0 + 2) * kTriangles);
    };
    if (at > 0 && run.continues(before))
      std::swap(here, north);
    else
      here.assign(row_of(run.row));
    north.assign(row_of(run.row + 1));
    const std::size_t width = static_cast<std::size_t>(run.col1 - run.col0) * kTriangles;
    compared.compare(here, north, std::span(edges).subspan(at, width));
    at += width;
    before = run;
  }
  return edges;
}

// Where the forward neighbours of a node are in a field of nodes, from where it is.
class ForwardOffsets {
 public:
  explicit ForwardOffsets(const TileField<LevelNode>& nodes) {
    const auto cols = static_cast<std::int32_t>(nodes.held().cols());
    for (std::size_t t = 0; t < kTriangles; ++t)
      for (std::size_t k = 0; k < kNeighbours; ++k) {
        const NodeOffset& o = kForwardTable[t].offset[k];
        offset_[t][k] = (o.row * cols + o.col) * kTriangles + o.triangle - static_cast<std::int32_t>(t);
      }
  }
  std::uint32_t from(std::uint32_t i, std::uint8_t t, int neighbour) const {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(i) + offset_[t][static_cast<std::size_t>(neighbour)]);
  }

 private:
  std::array<std::array<std::int32_t, kNeighbours>, kTriangles> offset_;
};

// The nodes around each square of a tile that have a plane, a bit each: square by square in ascending rows and columns.
class PlanesAround {
 public:
  explicit PlanesAround(const TileField<LevelNode>& nodes) : nodes_(nodes) {}
  // Edges to nodes without a plane, per node of a square.
  void at(Cell c, std::array<int, kTriangles>& open) {
    if (c.row != last_.row || c.col != last_.col + 1)
      for (std::int32_t col = -1; col <= 0; ++col) push({c.col + col, c.row});
    push({c.col + 1, c.row});
    last_ = c;
    for (std::size_t t = 0; t < kTriangles; ++t) open[t] = std::popcount(~bits_ & kNeighbourBits[t]);
  }

 private:
  static constexpr int kColumn = 3 * kTriangles;
  static constexpr auto kNeighbourBits = [] {
    std::array<std::uint64_t, kTriangles> bits{};
    for (std::size_t t = 0; t < kTriangles; ++t)
      for (const NodeOffset& o : kNeighbourTable[t])
        bits[t] |= std::uint64_t{1} << ((o.col + 1) * kColumn + (o.row + 1) * kTriangles + o.triangle);
    return bits;
  }();
  void push(Cell c) {
    std::uint64_t column = 0;
    for (std::int32_t row = -1; row <= 1; ++row) {
      const LevelNode* cell = nodes_.cell({c.col, c.row + row});
      for (int t = 0; t < kTriangles; ++t) column |= std::uint64_t{cell[t].has_plane()} << ((row + 1) * kTriangles + t);
    }
    bits_ = bits_ >> kColumn | column << 2 * kColumn;
  }
  const TileField<LevelNode>& nodes_;
  Cell last_{INT32_MIN, INT32_MIN};  // the bits are of the squares around it
  std::uint64_t bits_ = 0;
};

void link_tile(const TileField<LevelNode>& nodes, const LevelRegion& region, const LevelRules& rules,
               std::span<const Passage> passed, TileField<NodeKey>& ids, TileLinks& out) {
  const CellBox &box = nodes.interior(), core = box.grown(-1);
  const std::span<const LevelNode> value = nodes.values();
  out.edges = edges_of(nodes, region, rules);
  const ForwardOffsets forward(nodes);
  Components components(value.size());
  std::size_t at = 0;
  region.for_each_cell([&](Cell c) {
    const bool at_border = !core.contains(c);
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const auto i = static_cast<std::uint32_t>(nodes.offset(c) + t);
      for (unsigned links = out.edges[at++].linked; links != 0; links &= links - 1) {
        const int neighbour = std::countr_zero(links);
        const std::uint32_t j = forward.from(i, t, neighbour);
        if (value[i].level_class != value[j].level_class) continue;
        const NodeOffset& o = kForwardTable[t].offset[static_cast<std::size_t>(neighbour)];
        if (at_border && !box.contains({c.col + o.col, c.row + o.row}))
          out.links.push_back({i, j});
        else
          components.unite(i, j);
      }
    }
  });

  std::vector<std::uint32_t> index(value.size());
  PlanesAround around(nodes);
  std::array<int, kTriangles> open;
  region.for_each_cell([&](Cell cell) {
    around.at(cell, open);
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const auto i = static_cast<std::uint32_t>(nodes.offset(cell) + t);
      NodeKey& id = ids.cell(cell)[t];
      id = kNoComponent;
      if (!value[i].has_plane()) continue;
      const std::uint32_t root = components.find(i);
      if (root == i) {
        index[i] = static_cast<std::uint32_t>(out.components.size());
        out.components.push_back({node_key({cell, t}), {}});
        out.components.back().sums.above = value[i].level_class == LevelClass::kAbove;
      }
      LevelComponent& c = out.components[index[root]];
      id = c.id;
      ++c.sums.nodes;
      c.sums.above_mm += value[i].above_prior_mm;
      c.sums.tolerance_mm += value[i].tolerance_mm;
      c.sums.open += static_cast<std::uint64_t>(open[t]);
    }
  });
  for (const Passage& p : passed) {
    const auto i = static_cast<std::uint32_t>(nodes.offset(p.node.cell) + p.node.triangle);
    const LevelNode& n = value[i];
    const double x = p.dx_mm - n.mean_x_mm, y = p.dy_mm - n.mean_y_mm;
    if (n.has_plane() && p.borne_by(n.mean_z_mm + (n.slope_x * x + n.slope_y * y) / kSlopeUnit))
      ++out.components[index[components.find(i)]].sums.passages;
  }
}

// Counts edges of a kind between components. The last ones met are at hand, so that few of them are listed twice.
class RimCounter {
 public:
  void add(NodeKey a, NodeKey b, EdgeKind kind) {
    RimEdge& last = last_[(a * 31 + b * 7 + kind) % kLast];
    if (last.count > 0 && !last.same({a, b, kind, 0})) edges_.push_back(std::exchange(last, {}));
    last = {a, b, kind, last.count + 1};
  }
  std::vector<RimEdge> counted() {
    for (const RimEdge& e : last_)
      if (e.count > 0) edges_.push_back(e);
    std::sort(edges_.begin(), edges_.end());
    std::vector<RimEdge> out;
    for (const RimEdge& e : edges_)
      if (!out.empty() && out.back().same(e))
        out.back().count += e.count;
      else
        out.push_back(e);
    return out;
  }

 private:
  static constexpr std::size_t kLast = 1024;
  std::array<RimEdge, kLast> last_{};
  std::vector<RimEdge> edges_;
};

// The rims of the components of a tile: edges inside, and over the border where ours is the smaller key.
std::vector<RimEdge> rim_edges(const TileField<LevelNode>& nodes, const LevelRegion& region,
                               const std::vector<ForwardEdges>& edges, const TileField<NodeKey>& ids) {
  const std::span<const LevelNode> value = nodes.values();
  const std::span<const NodeKey> id = ids.values();
  const ForwardOffsets forward(nodes);
  RimCounter rims;
  std::size_t at = 0;
  region.for_each_node([&](NodeId n) {
    const auto i = static_cast<std::uint32_t>(nodes.offset(n.cell) + n.triangle);
    const ForwardEdges own = edges[at++];
    if (id[i] == kNoComponent) return;
    for (int k = 0; k < kForwardTable[n.triangle].count; ++k) {
      const std::uint32_t j = forward.from(i, n.triangle, k);
      if (id[i] == id[j] || id[j] == kNoComponent) continue;
      if ((own.linked >> k & 1) && value[i].level_class != value[j].level_class) rims.add(id[i], id[j], kAgreeEdge);
      rims.add(id[i], id[j], own.above >> k & 1 ? kUpEdge : own.below >> k & 1 ? kDownEdge : kLevelEdge);
    }
  });
  return rims.counted();
}

// A tile's part in the verdicts as the records have it.
void recall_rims(const Records& records, int round, const Tile& tile, TileRims& rims) {
  records.recall(record_number(round, Step::kRims), tile.id, tile.box, rims.components, rims.pairs, rims.edges);
}

// The components of a tile with their verdicts, ascending by id.
struct KnownVerdicts {
  std::vector<NodeKey> ids;
  std::vector<std::uint8_t> rejected;
};

// A component may be called by any of its nodes: what ranks do that tell each other all. Nodes of others in the halo,
// which has been exchanged, are called by themselves; returned is what own nodes in the halos of others belong to.
std::vector<LevelLink> call_by_nodes(const PassContext& context, const TileFields<LevelNode>& nodes, std::int32_t rings,
                                     TileFields<NodeKey>& ids) {
  copy_halo(context.table, ids, rings, context.threads, context.ranks.rank());
  const auto& tiles = context.table.tiles();
  std::vector<LevelLink> names;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    context.table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& strip) {
      if (context.owns(i) == context.owns(j)) return;
      const InUse tile({reads(nodes), writes(ids)}, context.owns(i) ? i : j);
      for_each_node(strip, [&](NodeId node) {
        if (context.owns(j)) {
          const NodeKey id = std::as_const(ids[j]).cell(node.cell)[node.triangle];
          if (id != kNoComponent && id != node_key(node)) names.push_back({id, node_key(node)});
        } else {
          const bool known = nodes[i].cell(node.cell)[node.triangle].has_plane();
          ids[i].cell(node.cell)[node.triangle] = known ? node_key(node) : kNoComponent;
        }
      });
    });
  sort_unique(names);
  return names;
}

}  // namespace

Judgement judge_level(const PassContext& context, const LevelRegions& regions, const LevelRules& rules,
                      const Records& records, int round, const Changes& fitted, LevelNodes& level) {
  const auto& tiles = context.table.tiles();
  const std::size_t n = tiles.size();
  TileFields<LevelNode>& nodes = level.fields;
  // A component is called by its smallest node in a tile: where nodes have changed, the neighbours call it by other
  // names too, and all of theirs are needed.
  TileSet rim_tiles = within(context.table, within(context.table, fitted, 0), kLinkHalo);
  add(rim_tiles, within(context.table, fitted, kLinkHalo));  // beside tiles that are gone
  const TileSet link_tiles = within(context.table, rim_tiles, kLinkHalo);
  level.need(link_tiles);
  // With all components known everywhere, and the halos of what follows, no rank has to ask for verdicts.
  const bool pooled = context.ranks.tells_all(context.table.node_count()) && !records.keep();
  const std::int32_t rings = pooled ? std::max(kLinkHalo, rules.completion_halo()) : kLinkHalo;
  exchange_halo(context.table, nodes, rings, context.threads, context.ranks, &rim_tiles);

  TileFields<NodeKey> ids(context.pager, n);
  Paged<TileLinks> tile_links(context.pager, n);
  const PassagesByTile passed(context.trajectory, context.table);
  const auto link = [&](const TileSet& set) {
    context.on(set).for_each_tile("link", {reads(nodes), writes(ids), writes(tile_links)}, [&](std::size_t i, int) {
      ids[i] = TileField<NodeKey>(nodes[i].interior(), nodes[i].halo());  // the same offsets
      link_tile(nodes[i], regions[i], rules, passed.of(i), ids[i], tile_links[i]);
    });
  };
  link(link_tiles);
  std::vector<LevelLink> names;
  if (pooled)
    names = call_by_nodes(context, nodes, rings, ids);
  else
    exchange_halo(context.table, ids, kLinkHalo, context.threads, context.ranks, &rim_tiles);

  Paged<TileRims> rims(context.pager, n);
  std::vector<KnownVerdicts> known(n);
  context.on(rim_tiles).for_each_tile("rim", {reads(nodes), reads(ids), writes(tile_links), writes(rims)},
                                      [&](std::size_t i, int) {
                                        const std::span<const NodeKey> id = std::as_const(ids[i]).values();
                                        for (const auto& [a, b] : tile_links[i].links)
                                          rims[i].pairs.push_back({id[a], id[b]});
                                        sort_unique(rims[i].pairs);
                                        rims[i].edges = rim_edges(nodes[i], regions[i], tile_links[i].edges, ids[i]);
                                        rims[i].components = std::move(tile_links[i].components);
                                        tile_links[i] = {};
                                        if (!records.keep()) return;
                                        records.save(record_number(round, Step::kRims), tiles[i].id, tiles[i].box,
                                                     rims[i].components, rims[i].pairs, rims[i].edges);
                                        for (const LevelComponent& c : rims[i].components) known[i].ids.push_back(c.id);
                                        std::sort(known[i].ids.begin(), known[i].ids.end());
                                      });
  records.finish(record_number(round, Step::kRims));
  if (records.follow()) {
    TileSet others(n);
    for (std::size_t i = 0; i < n; ++i) others[i] = !rim_tiles[i];
    context.on(others).for_each_tile("recall", {writes(rims)}, [&](std::size_t i, int) {
      recall_rims(records, round, tiles[i], rims[i]);
      std::vector<std::uint8_t> of_nodes;
      records.recall(record_number(round, Step::kVerdicts), tiles[i].id, tiles[i].box, known[i].ids, known[i].rejected,
                     of_nodes);
      records.require(known[i].rejected.size() == known[i].ids.size(), tiles[i].id);
    });
  }

  // What is taken together, and the sums that are made of it.
  const Pager::Claim claim(context.pager,
                           2 * bytes_in(rims, &TileRims::components, &TileRims::pairs, &TileRims::edges));
  std::vector<LevelComponent> components = take_all(rims, &TileRims::components);
  std::vector<LevelLink> pairs = take_all(rims, &TileRims::pairs);
  std::vector<RimEdge> edges = take_all(rims, &TileRims::edges);
  const auto alone = single_rank();
  if (pooled) {
    context.ranks.pool(components, pairs, edges, names);
    for (const LevelLink& name : names) components.push_back({name.b, {}});
    pairs.insert(pairs.end(), names.begin(), names.end());
  }
  const LevelVerdicts verdicts(components, pairs, edges, rules, pooled ? *alone : context.ranks);

  // Far from all changes a verdict may be another one now.
  Changes far(n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; context.owns(i) && !rim_tiles[i] && k < known[i].ids.size(); ++k)
      if (verdicts.is_rejected(known[i].ids[k]) != (known[i].rejected[k] != 0)) far.boxes[i] = tiles[i].box;
  if (records.follow()) far.share(context.ranks);
  TileSet judged = rim_tiles, unlinked = within(context.table, far, 0);
  add(judged, unlinked);
  for (std::size_t i = 0; i < n; ++i) unlinked[i] = unlinked[i] && !link_tiles[i];
  level.need(unlinked);
  link(unlinked);

  Changes overturned(n);
  context.on(judged).for_each_tile("verdict", {writes(nodes), reads(ids)}, [&](std::size_t i, int) {
    NodeKey asked = kNoComponent;  // neighbours mostly belong together
    bool rejected = false;
    const auto judge = [&](NodeKey id, LevelNode& node) {
      if (id != asked) {
        asked = id;
        rejected = id != kNoComponent && verdicts.is_rejected(id);
      }
      if (rejected) node.level_class = LevelClass::kRejected;
      return rejected;
    };
    if (!records.keep()) {
      const auto judge_node = [&](NodeId node) {
        judge(ids[i].cell(node.cell)[node.triangle], nodes[i].cell(node.cell)[node.triangle]);
      };
      regions[i].for_each_node(judge_node);
      if (pooled)
        context.table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& strip) {
          if (j != i) for_each_node(strip, judge_node);
        });
      return;
    }
    std::vector<std::uint8_t> of_nodes(static_cast<std::size_t>(tiles[i].box.cells()) * kTriangles);
    for_each_inner(nodes[i], [&](std::size_t at, std::size_t k, Cell c) {
      for (std::size_t t = 0; t < kTriangles; ++t) {
        of_nodes[k + t] = judge(std::as_const(ids[i]).values()[at + t], nodes[i].values()[at + t]);
        if (level.was_rejected(i, k + t) != of_nodes[k + t])
          overturned.boxes[i] = overturned.boxes[i].hull({c.col, c.row, c.col + 1, c.row + 1});
      }
    });
    known[i].rejected.clear();
    for (const NodeKey id : known[i].ids) known[i].rejected.push_back(verdicts.is_rejected(id));
    records.save(record_number(round, Step::kVerdicts), tiles[i].id, tiles[i].box, known[i].ids, known[i].rejected,
                 of_nodes);
  });
  records.finish(record_number(round, Step::kVerdicts));
  level.judged(judged);
  if (records.keep()) overturned.share(context.ranks);
  Judgement out{verdicts.counts(), records.keep() ? fitted : Changes::everywhere(context.table), overturned, pooled};
  out.changes.add(overturned);
  return out;
}

}  // namespace btms
