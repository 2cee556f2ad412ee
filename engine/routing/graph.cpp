#include "engine/routing/graph.h"

#include <utility>
#include <vector>

namespace btms {

TraversalGraph::TraversalGraph(Terrain terrain, const Parameters& parameters, std::size_t budget_bytes)
    : terrain_(std::move(terrain)), rules_(parameters), budget_bytes_(budget_bytes) {}

std::shared_ptr<const TileGraph> TraversalGraph::make(TileId id) const {
  const TileCache& tiles = terrain_.tiles();
  std::vector<std::shared_ptr<const TerrainTile>> around;
  for (std::int32_t dy = -1; dy <= 1; ++dy)
    for (std::int32_t dx = -1; dx <= 1; ++dx)
      if (dx != 0 || dy != 0)
        if (auto tile = tiles.load({id.tx + dx, id.ty + dy})) around.push_back(std::move(tile));
  return std::make_shared<const TileGraph>(*tiles.load(id), around, rules_);
}

std::shared_ptr<const TileGraph> TraversalGraph::tile(TileId id) const {
  if (!terrain_.tiles().contains(id)) return nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = where_.find(id); it != where_.end()) {
      kept_.splice(kept_.begin(), kept_, it->second);
      return it->second->graph;
    }
  }
  auto made = make(id);
  const std::lock_guard lock(mutex_);
  if (where_.contains(id)) return made;  // another thread was faster
  kept_.push_front({id, made});
  where_[id] = kept_.begin();
  bytes_ += made->memory_bytes();
  while (bytes_ > budget_bytes_ && kept_.size() > 1) {
    bytes_ -= kept_.back().graph->memory_bytes();
    where_.erase(kept_.back().id);
    kept_.pop_back();
  }
  return made;
}

}  // namespace btms
