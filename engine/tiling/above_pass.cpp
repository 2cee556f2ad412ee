// Pass "above": layers of every node from its points, and sheets joined to further surfaces. A component of sheets is a
// surface when it is large and high enough; it can be reached where it joins the terrain at the same height.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <tuple>
#include <utility>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/above.h"
#include "engine/terrain/level_links.h"
#include "engine/tiling/finished_tiles.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/merged_components.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/sparse_field.h"

namespace btms {
namespace {

// Edges to the terrain of a surface that can be reached: about those of an end 3 m wide, 12 on nodes of 2 m. A roof
// that meets a bank at a corner has fewer, the decks of the scenes and of real maps have 27 and more.
std::uint64_t least_joints(std::int32_t r_mm) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(3, 24'000 / r_mm));
}

struct SheetId {
  NodeKey node;
  std::uint64_t ordinal;  // of the sheets of the node, from below
  friend auto operator<=>(const SheetId&, const SheetId&) = default;
};
struct SheetComponent {
  SheetId id;
};
using SheetLink = ComponentLink<SheetId>;

struct Sheet {
  NodeKey node;
  std::uint64_t ordinal;
  SheetId component{};
  NodeSheet sheet;
  std::int32_t unused = 0;  // no padding in what is sent
  friend bool operator<(const Sheet& a, const Sheet& b) {
    return std::tie(a.node, a.ordinal) < std::tie(b.node, b.ordinal);
  }
};
static_assert(std::has_unique_object_representations_v<Sheet>);

// Sums over a component: its nodes with room between them and the surface, and its edges to terrain at its height.
struct SheetSums {
  SheetId component;
  std::uint64_t clear = 0, joints = 0;
};

// Of a whole component.
struct SheetTotal {
  std::uint64_t clear = 0, joints = 0;
  friend bool operator==(const SheetTotal&, const SheetTotal&) = default;
  SheetTotal& operator+=(const SheetTotal& o) {
    clear += o.clear, joints += o.joints;
    return *this;
  }
};

struct BorderLink {
  std::uint32_t inside, outside;  // positions in values()
};
struct TileLinks {
  std::vector<SheetComponent> components;
  std::vector<BorderLink> links;  // over the border

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(components), fn(links);
  }
};
// What a tile contributes to the verdicts.
struct TileSheets {
  std::vector<SheetComponent> components;
  std::vector<SheetLink> links;
  std::vector<SheetSums> sums;

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(components), fn(links), fn(sums);
  }
};

FinalPlane surface_of(const TerrainTile& tile, NodeId n) { return FinalPlane::through(n.triangle, tile.corners_mm(n)); }

// What a worker keeps for the points of a square.
struct AboveScratch {
  explicit AboveScratch(const LevelRules& rules) : sheets(rules) {}
  std::vector<std::int32_t> heights;
  SheetFinder sheets;
};

// Layers of the nodes of a square, and their sheets.
void look_above(Cell c, const SquarePoints& points, const LevelRules& rules, AboveScratch& s, TerrainTile& tile,
                std::vector<Sheet>& found) {
  std::size_t all = 0;
  for (const NodePoints& p : points) all += p.size;
  if (s.heights.size() < all) s.heights.resize(all);
  std::int32_t* heights = s.heights.data();
  SheetFinder::Square square{};
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    NodeSurface& node = tile.nodes[tile.node_index({c, t})];
    if (points[t].size == 0 || node.state == NodeState::kUnknown) continue;
    const FinalPlane surface = surface_of(tile, {c, t});
    const NodeLook look = look_over(points[t], surface, rules.r_mm(), node.terrain_mm, s.sheets.room_mm(), heights);
    square[t] = {points[t], heights, surface, node.terrain_mm, look.off};
    heights += points[t].size;
    node.roughness_mm = look.roughness_mm;
    if (look.clearance_mm != kNoneAbove)
      node.clearance_mm = static_cast<std::uint16_t>(std::min(look.clearance_mm, kNothingAbove - 1));
  }
  s.sheets.find(square);
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    std::uint64_t ordinal = 0;
    for (const NodeSheet& sheet : s.sheets.sheets(t))
      found.push_back({.node = node_key({c, t}), .ordinal = ordinal++, .sheet = sheet});
  }
}

using SheetLists = Paged<std::vector<Sheet>>;  // one a tile

// Layers of every node with points and a surface; the sheets of each tile.
SheetLists look_above(const PassContext& context, const OrderedPoints& points, const LevelRules& rules,
                      FinishedTiles& tiles) {
  struct Worker {
    AboveScratch scratch;
    std::vector<Sheet> found;
  };
  std::vector<Worker> workers(static_cast<std::size_t>(context.threads.count()), {AboveScratch(rules), {}});
  SheetLists sheets(context.pager, tiles.size());
  std::mutex mutex;
  points.for_each_bin("above", context.threads, context.progress, context.only,
                      [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int worker) {
                        const InUse tile({writes(tiles), writes(sheets)}, i);
                        Worker& w = workers[static_cast<std::size_t>(worker)];
                        w.found.clear();
                        for_each_square(bin, cells_of(id, points.order().refinements()),
                                        [&](Cell c, const SquarePoints& square) {
                                          look_above(c, square, rules, w.scratch, tiles[i], w.found);
                                        });
                        const std::lock_guard lock(mutex);
                        sheets[i].insert(sheets[i].end(), w.found.begin(), w.found.end());
                      });
  return sheets;
}

// Calls fn(offset of the neighbour's cell from the sheet's, the neighbour).
template <class Fn>
void for_each_neighbour(const Sheet& sheet, const Fn& fn) {
  const NodeId n = node_of_key(sheet.node);
  for (const NodeOffset& o : kNeighbourTable[n.triangle])
    fn(o, NodeId{{n.cell.col + o.col, n.cell.row + o.row}, o.triangle});
}

// Joins the sheets of a tile; writes their components.
void link_tile(SparseField<Sheet>& field, const LevelRules& rules, TileLinks& out) {
  const std::span<Sheet> sheets = field.values();
  const std::size_t inside = field.inside().size();
  Components components(inside);
  for (std::uint32_t i = 0; i < inside; ++i) {
    const Sheet& a = sheets[i];
    for_each_neighbour(a, [&](const NodeOffset& o, NodeId n) {
      const std::uint32_t end = field.end(n);
      // Every inner edge once: with the sheet further ahead.
      if (end <= i) return;
      for (std::uint32_t j = field.begin(n); j < end; ++j) {
        if (!compare(a.sheet.plane, sheets[j].sheet.plane, o.col * rules.r_mm(), o.row * rules.r_mm(), rules).linked)
          continue;
        if (j < inside)
          components.unite(i, j);
        else
          out.links.push_back({i, j});
      }
    });
  }
  for (std::uint32_t i = 0; i < inside; ++i) {
    const std::uint32_t root = components.find(i);  // the smallest member
    sheets[i].component = {sheets[root].node, sheets[root].ordinal};
    if (root == i) out.components.push_back({sheets[i].component});
  }
}

// What this tile knows of the components: their nodes inside it, and their edges, from its halo too, to its terrain.
std::vector<SheetSums> sums_of(const SparseField<Sheet>& field, const TerrainTile& tile, const LevelRules& rules) {
  const double room_mm = rules.p().upper_gap_m * 1000;
  std::vector<SheetSums> sums;
  for (const Sheet& s : field.values()) {
    SheetSums own{s.component};
    own.clear = field.interior().contains(node_of_key(s.node).cell) && std::abs(s.sheet.above_mm) > room_mm;
    for_each_neighbour(s, [&](const NodeOffset& o, NodeId n) {
      if (!field.interior().contains(n.cell) || tile.nodes[tile.node_index(n)].state != NodeState::kObserved) return;
      const LevelNode terrain = surface_node(n.triangle, surface_of(tile, n), rules.r_mm());
      own.joints += compare(s.sheet.plane, terrain, o.col * rules.r_mm(), o.row * rules.r_mm(), rules).linked;
    });
    if (own.clear || own.joints) sums.push_back(own);
  }
  std::sort(sums.begin(), sums.end(), [](const auto& a, const auto& b) { return a.component < b.component; });
  std::vector<SheetSums> merged;
  for (const SheetSums& s : sums)
    if (!merged.empty() && merged.back().component == s.component)
      merged.back().clear += s.clear, merged.back().joints += s.joints;
    else
      merged.push_back(s);
  return merged;
}

}  // namespace

namespace {

// What is decided about a component of sheets.
struct SheetVerdict {
  SheetId component;
  std::uint32_t surface;  // a further surface, not clutter
  std::uint32_t reachable;
  friend bool operator==(const SheetVerdict&, const SheetVerdict&) = default;
};

}  // namespace

void above_pass(const PassContext& context, const OrderedPoints& points, const Records& records, FinalTiles& finished) {
  const TileTable& table = context.table;
  const std::size_t n = table.tiles().size();
  const LevelRules rules(context.parameters, table.layout().lattice.resolution_mm(), false,
                         false);  // a deck is not smooth ground: the wider scale
  const int sheets_kept = record_number(kAfterRounds, Step::kSheets),
            joined_kept = record_number(kAfterRounds, Step::kJoined),
            verdicts_kept = record_number(kAfterRounds, Step::kVerdicts);
  SheetLists found = look_above(context.on(finished.made()), points, rules, finished.values);
  if (records.keep())
    context.on(finished.made()).for_each_tile("save", {reads(found)}, [&](std::size_t i, int) {
      records.save(sheets_kept, table.tiles()[i].id, table.tiles()[i].box, found[i]);
    });
  records.finish(sheets_kept);

  SparseFields<Sheet> sheets(context.pager, n);
  Paged<TileLinks> linked(context.pager, n);
  const auto fetch = [&](const TileSet& tiles) {
    context.on(tiles).for_each_tile("sheets", {writes(found), writes(sheets)}, [&](std::size_t i, int) {
      const Tile& tile = table.tiles()[i];
      if (!finished.made()[i]) records.recall(sheets_kept, tile.id, tile.box, found[i]);
      sheets[i] = SparseField<Sheet>(tile.box, kLinkHalo);
      sheets[i].assign(found[i]);
      std::vector<Sheet>().swap(found[i]);
    });
  };
  const auto link = [&](const TileSet& tiles) {
    context.on(tiles).for_each_tile("link sheets", {writes(sheets), writes(linked)},
                                    [&](std::size_t i, int) { link_tile(sheets[i], rules, linked[i]); });
  };
  // As in judge_level: a tile's part in the verdicts names the components of its neighbours.
  const TileSet join_tiles = within(table, finished.made(), kLinkHalo),
                link_tiles = within(table, join_tiles, kLinkHalo);
  finished.need(join_tiles, context);
  fetch(link_tiles);
  exchange_halo(table, sheets, kLinkHalo, context.threads, context.ranks, &join_tiles);
  link(link_tiles);
  exchange_halo(table, sheets, kLinkHalo, context.threads, context.ranks, &join_tiles);  // the components this time

  Paged<TileSheets> joined(context.pager, n);
  std::vector<std::vector<SheetVerdict>> verdicts(n);  // of the components of a tile
  context.for_each_tile("join sheets", {reads(sheets), reads(finished.values), writes(linked), writes(joined)},
                        [&](std::size_t i, int) {
                          const Tile& tile = table.tiles()[i];
                          TileSheets& own = joined[i];
                          if (!join_tiles[i]) {
                            records.recall(joined_kept, tile.id, tile.box, own.components, own.links, own.sums);
                            records.recall(verdicts_kept, tile.id, tile.box, verdicts[i]);
                            return;
                          }
                          const std::span<const Sheet> here = std::as_const(sheets[i]).values();
                          own.components = std::move(linked[i].components);
                          for (const auto& [a, b] : linked[i].links)
                            own.links.push_back({here[a].component, here[b].component});
                          sort_unique(own.links);
                          own.sums = sums_of(sheets[i], finished.values[i], rules);
                          if (!records.keep()) return;
                          records.save(joined_kept, tile.id, tile.box, own.components, own.links, own.sums);
                          for (const SheetComponent& c : own.components) verdicts[i].push_back({c.id, 0, 0});
                        });
  records.finish(joined_kept);
  // What is taken together, and the sums that are made of it.
  const Pager::Claim claim(context.pager,
                           2 * bytes_in(joined, &TileSheets::components, &TileSheets::links, &TileSheets::sums));
  auto components = take_all(joined, &TileSheets::components);
  auto links = take_all(joined, &TileSheets::links);
  std::vector<SheetSums> sums = take_all(joined, &TileSheets::sums);
  const auto alone = single_rank();
  const bool pooled = context.ranks.tells_all(table.node_count());
  if (pooled) context.ranks.pool(components, links, sums);
  std::vector<SheetId> summed;
  for (const SheetSums& s : sums) summed.push_back(s.component);
  const MergedComponents<SheetId> merged(components, links, std::move(summed), pooled ? *alone : context.ranks);
  std::vector<SheetTotal> total(merged.size());
  for (const SheetSums& s : sums) total[merged.whole(s.component)] += {s.clear, s.joints};
  merged.add_up(total);
  const auto judge = [&](const SheetId& component) -> SheetVerdict {
    const SheetTotal& whole = total[merged.whole(component)];
    return {component, whole.clear >= static_cast<std::uint64_t>(rules.p().upper_nodes),
            whole.joints >= least_joints(rules.r_mm())};
  };
  // Far from all changes a verdict may be another one now.
  TileSet listed = join_tiles, unlinked(n);
  Changes overturned(n);
  for (std::size_t i = 0; i < n; ++i)
    for (SheetVerdict& v : verdicts[i]) {
      const SheetVerdict now = judge(v.component);
      if (!join_tiles[i] && now != v) overturned.boxes[i] = table.tiles()[i].box;
      v = now;
    }
  if (records.follow()) overturned.share(context.ranks);
  finished.overturned = within(table, overturned, 0);
  add(listed, finished.overturned);
  for (std::size_t i = 0; i < n; ++i) unlinked[i] = listed[i] && !link_tiles[i];
  fetch(unlinked);
  link(unlinked);
  finished.need(listed, context);

  context.on(listed).for_each_tile("upper", {reads(sheets), writes(finished.values)}, [&](std::size_t i, int) {
    TerrainTile& tile = finished.values[i];
    tile.upper.clear();
    for (const Sheet& s : std::as_const(sheets[i]).inside()) {
      const SheetVerdict verdict = judge(s.component);
      if (!verdict.surface) continue;
      const LevelNode& plane = s.sheet.plane;
      tile.upper.push_back({static_cast<std::uint32_t>(tile.node_index(node_of_key(s.node))),
                            height_at_centre_mm(plane), plane.slope_x, plane.slope_y, plane.sd_mm, plane.count,
                            verdict.reachable ? UpperKind::kReachable : UpperKind::kDetached});
    }
    std::stable_sort(tile.upper.begin(), tile.upper.end(), [](const UpperNode& a, const UpperNode& b) {
      return std::tie(a.node, a.z_mm) < std::tie(b.node, b.z_mm);
    });
    records.save(verdicts_kept, table.tiles()[i].id, table.tiles()[i].box, verdicts[i]);
  });
  records.finish(verdicts_kept);
}

}  // namespace btms
