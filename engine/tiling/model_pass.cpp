#include <algorithm>
#include <mutex>

#include "engine/error.h"
#include "engine/terrain/model_nodes.h"
#include "engine/tiling/node_sort.h"
#include "engine/tiling/passes.h"

namespace btms {
namespace {

struct Scratch {
  PointBins::Scratch points;
  NodeSort sort;
  ModelNodesScratch model;
  TileField<Node> nodes;  // of one bin
};

void model_bin(const PointBins::Bin& bin, const BinGrid& grid, const NodeModelRules& rules, Scratch& s) {
  s.sort.sort(bin, grid);
  const std::span<Node> nodes = s.nodes.values();
  model_nodes(
      nodes.size(), [&](std::size_t k) { return s.sort.node(k); }, rules, s.model,
      [&](std::size_t k, const Node& node) { nodes[k] = node; });
}

}  // namespace

void PassContext::for_each_tile(const char* phase, const std::vector<Use>& uses,
                                const std::function<void(std::size_t, int)>& body) const {
  std::vector<std::size_t> mine;
  for (std::size_t i = 0; i < table.tiles().size(); ++i)
    if (owns(i) && (!only || (*only)[i])) mine.push_back(i);
  if (mine.empty()) return;
  if (!pager.limited())  // big tiles first: the last one to run should be short
    std::stable_sort(mine.begin(), mine.end(), [&](std::size_t a, std::size_t b) {
      return table.tiles()[a].box.cells() > table.tiles()[b].box.cells();
    });
  else if (pager.turn())  // from where the pass before has ended: that is in memory still
    std::reverse(mine.begin(), mine.end());
  progress.begin(phase, mine.size(), "tiles");
  threads.for_each(mine.size(), [&](std::size_t i, int worker) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, std::string("stopped in ") + phase);
    const InUse tile(uses, mine[i]);
    body(mine[i], worker);
    progress.advance(1);
  });
}

void model_pass(const PassContext& context, PointBins&& bins, const BinGrid& grid, NodeFields& nodes) {
  const NodeModelRules rules(context.parameters);
  std::vector<Scratch> scratch(static_cast<std::size_t>(context.threads.count()));
  std::vector<Bytes> out(static_cast<std::size_t>(context.ranks.size()));
  std::mutex out_mutex;

  // Full bins first.
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t k = 0; k < bins.size(); ++k) order.emplace_back(bins.points_in(k), k);
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first > b.first; });

  context.progress.begin("model", bins.counts().points, "points");
  context.threads.for_each(order.size(), [&](std::size_t i, int worker) {
    if (context.progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped in model");
    const auto [size, k] = order[i];
    if (size > 0xffffffffu)
      throw Error(ErrorCode::kBadInput, "more than 4294967295 points in one block of " +
                                            std::to_string(grid.edge_mm() / 1000) + " m: thin the input");
    Scratch& s = scratch[static_cast<std::size_t>(worker)];
    TileField<Node>& result = s.nodes;
    result = TileField<Node>(grid.box_of(bins.id(k)), 0);
    bins.take(k, s.points, [&](const PointBins::Bin& bin) { model_bin(bin, grid, rules, s); });
    context.table.for_each_overlap(result.interior(), [&](std::size_t tile, const CellBox& part) {
      if (context.owns(tile)) {
        nodes.edit(tile)->copy_box(part, result);
        return;
      }
      const std::lock_guard lock(out_mutex);
      pack_strip(tile, part, result, out[static_cast<std::size_t>(context.table.tiles()[tile].owner)]);
    });
    context.progress.advance(size);
  });
  NodeFields* const fields[] = {&nodes};
  if (context.ranks.size() > 1) unpack_strips<Node>(context.ranks.exchange(std::move(out)), fields);
}

}  // namespace btms
