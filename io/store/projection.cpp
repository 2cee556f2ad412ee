#include "io/store/projection.h"

#include <proj.h>

#include <mutex>

#include "engine/error.h"

namespace btms {
namespace {

struct ContextDeleter {
  void operator()(PJ_CONTEXT* c) const { proj_context_destroy(c); }
};
struct ObjectDeleter {
  void operator()(PJ* p) const { proj_destroy(p); }
};
using Context = std::unique_ptr<PJ_CONTEXT, ContextDeleter>;
using Object = std::unique_ptr<PJ, ObjectDeleter>;

// x before y, or longitude before latitude, whatever the systems' own orders are.
Object between(PJ_CONTEXT* context, const char* from, const char* to) {
  const Object made(proj_create_crs_to_crs(context, from, to, nullptr));
  if (!made) return nullptr;
  return Object(proj_normalize_for_visualization(context, made.get()));
}

void convert(PJ* way, std::span<Place> places) {
  static_assert(sizeof(Place) == 2 * sizeof(double));
  if (places.empty()) return;
  proj_trans_generic(way, PJ_FWD, &places[0].x_m, sizeof(Place), places.size(), &places[0].y_m, sizeof(Place),
                     places.size(), nullptr, 0, 0, nullptr, 0, 0);
}

}  // namespace

struct Projection::Systems {
  Context context{proj_context_create()};
  Object from_mercator, to_degrees;
  std::mutex mutex;  // PROJ objects serve one thread at a time
};

Projection::Projection(const std::string& map_crs_wkt) : systems_(std::make_unique<Systems>()) {
  if (map_crs_wkt.empty())
    throw Error(ErrorCode::kUsage, "the map names no reference system; `btms build --crs EPSG:n` gives it one");
  PJ_CONTEXT* context = systems_->context.get();
  proj_log_level(context, PJ_LOG_NONE);
  systems_->from_mercator = between(context, "EPSG:3857", map_crs_wkt.c_str());
  systems_->to_degrees = between(context, map_crs_wkt.c_str(), "EPSG:4326");
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
