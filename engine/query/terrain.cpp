#include "engine/query/terrain.h"

#include <algorithm>

#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

// A place on the lattice.
struct Spot {
  std::int64_t x_mm = 0, y_mm = 0;
  Cell cell;
  bool on_plane = false;  // false: no map can be there
};

Spot spot_of(const MapLayout& layout, Place place) {
  constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  if (!(std::abs(place.x_m) <= kLimit_m && std::abs(place.y_m) <= kLimit_m)) return {};
  Spot spot;
  spot.x_mm = static_cast<std::int64_t>(std::floor(place.x_m * 1000 + 0.5));
  spot.y_mm = static_cast<std::int64_t>(std::floor(place.y_m * 1000 + 0.5));
  spot.cell = layout.lattice.cell_at(spot.x_mm, spot.y_mm);
  spot.on_plane = true;
  return spot;
}

void take(HeightAnswer& answer, const UpperPoint& upper, std::size_t which) {
  answer.surface = static_cast<std::uint8_t>(which + 1);
  answer.z_m = upper.z_m;
  answer.variance_m2 = upper.sd_m * upper.sd_m;
  std::copy(std::begin(upper.normal), std::end(upper.normal), answer.normal);
  answer.cost = upper.kind == UpperKind::kReachable ? std::numeric_limits<float>::quiet_NaN()
                                                    : std::numeric_limits<float>::infinity();
}

HeightAnswer answer_in(const TerrainTile& tile, const Spot& spot, double z_hint_m) {
  HeightAnswer answer;
  if (!tile.box.contains(spot.cell)) return answer;
  const SurfacePoint terrain = surface_in(tile, spot.x_mm, spot.y_mm);
  answer.state = terrain.state;
  const bool known = terrain.state != NodeState::kUnknown;
  if (known) {
    answer.z_m = terrain.z_m;
    answer.variance_m2 = terrain.sd_m * terrain.sd_m;
    std::copy(std::begin(terrain.normal), std::end(terrain.normal), answer.normal);
    answer.cost = static_cast<float>(terrain.cost);
    answer.surfaces = 1;
  }
  // Few tiles have further surfaces, and few places of those.
  const bool hinted = !std::isnan(z_hint_m);
  bool found = known;
  for_each_upper_in(tile, spot.x_mm, spot.y_mm, [&](std::size_t n, const UpperPoint& upper) {
    answer.surfaces = static_cast<std::uint8_t>(std::min(answer.surfaces + 1, 255));
    const bool better = !found   ? hinted || upper.kind == UpperKind::kReachable
                        : hinted ? std::abs(upper.z_m - z_hint_m) < std::abs(answer.z_m - z_hint_m)
                                 : !known && upper.kind == UpperKind::kReachable && upper.z_m < answer.z_m;
    if (!better) return;
    take(answer, upper, n);
    found = true;
  });
  answer.status = found ? QueryStatus::kOk : QueryStatus::kUnknown;
  return answer;
}

HeightAnswer damaged() {
  HeightAnswer answer;
  answer.status = QueryStatus::kDamaged;
  return answer;
}

}  // namespace

const char* query_status_name(QueryStatus status) {
  switch (status) {
    case QueryStatus::kOk:
      return "ok";
    case QueryStatus::kUnknown:
      return "unknown";
    case QueryStatus::kDamaged:
      return "damaged";
    case QueryStatus::kOutside:
      break;
  }
  return "outside";
}

const char* node_state_name(NodeState state) {
  switch (state) {
    case NodeState::kObserved:
      return "observed";
    case NodeState::kPredicted:
      return "predicted";
    case NodeState::kObstacle:
      return "obstacle";
    case NodeState::kFilled:
      return "filled";
    case NodeState::kUnknown:
      break;
  }
  return "unknown";
}

Terrain::Terrain(std::shared_ptr<const TileSource> map, const TerrainOptions& options)
    : tiles_(std::make_shared<const TileCache>(std::move(map), options.cache_bytes)) {}

HeightAnswer Terrain::height(Place place, double z_hint_m) const noexcept {
  const Spot spot = spot_of(layout(), place);
  if (!spot.on_plane) return {};
  try {
    const TileCache::Pin tile = tiles_->pin(layout().grid.tile_of(spot.cell));
    return tile ? answer_in(*tile, spot, z_hint_m) : HeightAnswer{};
  } catch (...) {
    return damaged();
  }
}

void Terrain::heights(std::span<const Place> places, std::span<HeightAnswer> answers) const noexcept {
  heights(places, {}, answers);
}

// Places come along paths and in windows: the tile of the one before is mostly theirs, too.
void Terrain::heights(std::span<const Place> places, std::span<const double> hints_m,
                      std::span<HeightAnswer> answers) const noexcept {
  const MapLayout& map = layout();
  TileCache::Pin tile;
  CellBox box;  // of `tile`, whole
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Spot spot = spot_of(map, places[i]);
    answers[i] = {};
    if (!spot.on_plane) continue;
    try {
      if (!box.contains(spot.cell)) {
        const TileId id = map.grid.tile_of(spot.cell);
        box = {};
        tile = tiles_->pin(id);
        box = map.grid.box_of(id);
      }
      if (tile) answers[i] = answer_in(*tile, spot, hints_m.empty() ? kNoHint : hints_m[i]);
    } catch (...) {
      answers[i] = damaged();
    }
  }
}

Terrain::Detail Terrain::detail(Place place) const {
  Detail out;
  const Spot spot = spot_of(layout(), place);
  if (!spot.on_plane) return out;
  const TileCache::Pin tile = tiles_->pin(layout().grid.tile_of(spot.cell));
  if (!tile || !tile->box.contains(spot.cell)) return out;
  out.surface = surface_in(*tile, spot.x_mm, spot.y_mm);
  out.upper = upper_surfaces_in(*tile, spot.x_mm, spot.y_mm);
  out.status = out.surface.state == NodeState::kUnknown ? QueryStatus::kUnknown : QueryStatus::kOk;
  return out;
}

}  // namespace btms
