#include "engine/tiling/passes.h"

namespace btms {
namespace {

// Nodes with points, or with a surface.
void count_nodes(const TerrainTile& tile, CommitSummary& sums) {
  for (const NodeSurface& n : tile.nodes) {
    sums.observed += n.state == NodeState::kObserved;
    sums.predicted += n.state == NodeState::kPredicted;
    sums.obstacle += n.state == NodeState::kObstacle;
    sums.filled += n.state == NodeState::kFilled;
    sums.unknown += n.state == NodeState::kUnknown && n.count > 0;
  }
}

}  // namespace

CommitSummary& CommitSummary::operator+=(const CommitSummary& o) {
  digest += o.digest;
  tiles += o.tiles;
  observed += o.observed, predicted += o.predicted, obstacle += o.obstacle, filled += o.filled, unknown += o.unknown;
  return *this;
}

CommitSummary commit_pass(const PassContext& context, FinishedTiles&& finished, TileSink& sink) {
  const auto& tiles = context.table.tiles();
  std::vector<CommitSummary> sums(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("commit", {writes(finished)}, [&](std::size_t i, int worker) {
    TerrainTile tile = std::move(finished[i]);
    CommitSummary here;
    count_nodes(tile, here);
    if (here.nodes() == 0) return;  // nothing reached this tile
    here.tiles = 1;
    here.digest = sink.put(tiles[i].id, std::move(tile));
    sums[static_cast<std::size_t>(worker)] += here;
  });
  CommitSummary all;
  for (const CommitSummary& s : sums) all += s;
  return all;
}

}  // namespace btms
