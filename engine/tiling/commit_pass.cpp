#include "engine/tiling/finished_tiles.h"

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

bool same(const TerrainTile& a, const TerrainTile& b) {
  return a.resolution_mm == b.resolution_mm && a.box == b.box && a.corner_mm == b.corner_mm &&
         a.centre_mm == b.centre_mm && a.nodes == b.nodes && a.upper == b.upper;
}

}  // namespace

CommitSummary& CommitSummary::operator+=(const CommitSummary& o) {
  digest += o.digest;
  tiles += o.tiles;
  renewed += o.renewed;
  observed += o.observed, predicted += o.predicted, obstacle += o.obstacle, filled += o.filled, unknown += o.unknown;
  return *this;
}

CommitSummary commit_pass(const PassContext& context, FinalTiles&& finished, TileSink& sink) {
  const auto& tiles = context.table.tiles();
  std::vector<CommitSummary> sums(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("commit", {writes(finished.values)}, [&](std::size_t i, int worker) {
    const auto before = finished.before() ? finished.before()->load(tiles[i].id) : nullptr;
    TerrainTile tile = std::move(finished.values[i]);
    const bool keep = before && (!finished.is_here(i) || same(tile, *before));
    CommitSummary here;
    if (!finished.is_here(i) && !before) return;
    count_nodes(keep ? *before : tile, here);
    if (here.nodes() == 0) return;  // nothing reached this tile
    here.tiles = 1;
    here.renewed = !keep;
    here.digest = keep ? sink.keep(tiles[i].id, *before) : sink.put(tiles[i].id, std::move(tile));
    sums[static_cast<std::size_t>(worker)] += here;
  });
  CommitSummary all;
  for (const CommitSummary& s : sums) all += s;
  return all;
}

}  // namespace btms
