#include "io/store/projection.h"

#include <mutex>

#include "engine/error.h"
#include "io/crs/proj_objects.h"

namespace btms {
namespace {

// x before y, or longitude before latitude, whatever the systems' own orders are.
ProjObject between(PJ_CONTEXT* context, PJ* from, PJ* to) {
  const ProjObject made(from && to ? proj_create_crs_to_crs_from_pj(context, from, to, nullptr, nullptr) : nullptr);
  return ProjObject(made ? proj_normalize_for_visualization(context, made.get()) : nullptr);
}

void convert(PJ* way, std::span<Place> places) {
  static_assert(sizeof(Place) == 2 * sizeof(double));
  if (places.empty()) return;
  proj_trans_generic(way, PJ_FWD, &places[0].x_m, sizeof(Place), places.size(), &places[0].y_m, sizeof(Place),
                     places.size(), nullptr, 0, 0, nullptr, 0, 0);
}

}  // namespace

struct Projection::Systems {
  ProjContext context = quiet_proj_context();
  ProjObject from_mercator, to_degrees;
  std::mutex mutex;  // PROJ objects serve one thread at a time
};

Projection::Projection(const std::string& map_crs_wkt) : systems_(std::make_unique<Systems>()) {
  if (map_crs_wkt.empty())
    throw Error(ErrorCode::kUsage, "the map names no reference system; `btms build --crs EPSG:n` gives it one");
  PJ_CONTEXT* context = systems_->context.get();
  // As WKT and nothing else: proj_create() would also open files that a text names.
  const ProjObject map(proj_create_from_wkt(context, map_crs_wkt.c_str(), nullptr, nullptr, nullptr));
  const ProjObject mercator(proj_create(context, "EPSG:3857")), degrees(proj_create(context, "EPSG:4326"));
  systems_->from_mercator = between(context, mercator.get(), map.get());
  systems_->to_degrees = between(context, map.get(), degrees.get());
  if (!systems_->from_mercator || !systems_->to_degrees)
    throw Error(ErrorCode::kUsage, "no way is known between the map's reference system and WGS 84");
}

Projection::~Projection() = default;

void Projection::mercator_to_map(std::span<Place> places) const {
  const std::lock_guard lock(systems_->mutex);
  convert(systems_->from_mercator.get(), places);
}

void Projection::map_to_degrees(std::span<Place> places) const {
  const std::lock_guard lock(systems_->mutex);
  convert(systems_->to_degrees.get(), places);
}

}  // namespace btms
