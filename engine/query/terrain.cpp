#include "engine/query/terrain.h"

#include <algorithm>

#include "engine/query/tile_cursor.h"

namespace btms {
namespace {

void take(HeightAnswer& answer, const UpperPoint& upper, std::size_t which) {
  answer.surface = static_cast<std::uint8_t>(which + 1);
  answer.z_m = upper.z_m;
  answer.variance_m2 = upper.sd_m * upper.sd_m;
  std::copy(std::begin(upper.normal), std::end(upper.normal), answer.normal);
  answer.cost = upper.kind == UpperKind::kReachable ? std::numeric_limits<float>::quiet_NaN()
                                                    : std::numeric_limits<float>::infinity();
}

HeightAnswer answer_in(const TerrainTile& tile, PlaceMm place, double z_hint_m) {
  HeightAnswer answer;
  const SurfacePoint terrain = surface_in(tile, place.x, place.y);
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
  for_each_upper_in(tile, place.x, place.y, [&](std::size_t n, const UpperPoint& upper) {
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

HeightAnswer answer_at(TileCursor& cursor, const Lattice& lattice, Place place, double z_hint_m) noexcept {
  if (!on_plane(place)) return {};
  const PlaceMm mm = to_mm(place);
  if (const TerrainTile* tile = cursor.at(lattice.cell_at(mm.x, mm.y))) return answer_in(*tile, mm, z_hint_m);
  HeightAnswer answer;
  if (cursor.damaged()) answer.status = QueryStatus::kDamaged;
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
  TileCursor cursor(*tiles_);
  return answer_at(cursor, layout().lattice, place, z_hint_m);
}

void Terrain::heights(std::span<const Place> places, std::span<HeightAnswer> answers) const noexcept {
  heights(places, {}, answers);
}

void Terrain::heights(std::span<const Place> places, std::span<const double> hints_m,
                      std::span<HeightAnswer> answers) const noexcept {
  TileCursor cursor(*tiles_);
  const Lattice lattice = layout().lattice;
  for (std::size_t i = 0; i < places.size(); ++i)
    answers[i] = answer_at(cursor, lattice, places[i], hints_m.empty() ? kNoHint : hints_m[i]);
}

Terrain::Detail Terrain::detail(Place place) const {
  Detail out;
  if (!on_plane(place)) return out;
  const PlaceMm mm = to_mm(place);
  const Cell cell = layout().lattice.cell_at(mm.x, mm.y);
  const TileCache::Pin tile = tiles_->pin(layout().grid.tile_of(cell));
  if (!tile || !tile->box.contains(cell)) return out;
  out.surface = surface_in(*tile, mm.x, mm.y);
  out.upper = upper_surfaces_in(*tile, mm.x, mm.y);
  out.status = out.surface.state == NodeState::kUnknown ? QueryStatus::kUnknown : QueryStatus::kOk;
  return out;
}

}  // namespace btms
