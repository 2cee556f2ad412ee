#include "io/crs/reprojection.h"

#include <proj_experimental.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/error.h"
#include "io/crs/proj_crs.h"

namespace btms {
namespace {

bool is_geocentric(const PJ* crs) { return proj_get_type(crs) == PJ_TYPE_GEOCENTRIC_CRS; }

// PROJ's objects belong to one thread at a time.
struct Way {
  ProjContext context;
  ProjObject way;
  bool with_heights = false;
};

// x, y in the order of maps, whatever the systems say.
ProjObject way_between(PJ_CONTEXT* context, const PJ* source, const PJ* target) {
  constexpr const char* kNoGuess[] = {"ALLOW_BALLPARK=NO", nullptr};  // which would take datums for equal
  const ProjObject way(proj_create_crs_to_crs_from_pj(context, source, target, nullptr, kNoGuess));
  return way ? ProjObject(proj_normalize_for_visualization(context, way.get())) : nullptr;
}

Way find_way(const std::string& source, const std::string& target) {
  Way out{quiet_proj_context(), nullptr};
  PJ_CONTEXT* context = out.context.get();
  const ProjObject whole = parse_crs(context, source), aim = parse_crs(context, target);
  ProjObject from = whole ? crs_part(context, whole.get(), 0) : nullptr,
             to = aim ? plane_part(context, aim.get()) : nullptr;
  if (from && to) {
    out.with_heights = is_geocentric(from.get());
    if (out.with_heights)
      to.reset(proj_crs_promote_to_3D(context, nullptr, to.get()));
    else
      from = plane_part(context, whole.get());
  }
  if (from && to) out.way = way_between(context, from.get(), to.get());
  if (!out.way)
    throw Error(ErrorCode::kUsage,
                "PROJ knows no way between the coordinate reference systems; reproject the file first");
  return out;
}

class ProjReprojection final : public Reprojection {
 public:
  ProjReprojection(std::string source, std::string target) : source_(std::move(source)), target_(std::move(target)) {
    idle_.push_back(find_way(source_, target_));
  }

  void apply(double* x, double* y, double* z, std::size_t n) const override {
    Way way = take();
    std::vector<double> flat;
    if (!way.with_heights) flat.assign(n, 0);
    constexpr std::size_t kStep = sizeof(double);
    proj_trans_generic(way.way.get(), PJ_FWD, x, kStep, n, y, kStep, n, way.with_heights ? z : flat.data(), kStep, n,
                       nullptr, 0, 0);
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(way));
  }

 private:
  Way take() const {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        Way way = std::move(idle_.back());
        idle_.pop_back();
        return way;
      }
    }
    return find_way(source_, target_);
  }

  const std::string source_, target_;
  mutable std::mutex mutex_;  // guards idle_
  mutable std::vector<Way> idle_;
};

}  // namespace

std::unique_ptr<Reprojection> reprojection(const std::string& source, const std::string& target) {
  return std::make_unique<ProjReprojection>(source, target);
}

std::string utm_of(const std::string& source, const std::array<double, 3>& place) {
  const ProjContext owner = quiet_proj_context();
  PJ_CONTEXT* context = owner.get();
  const ProjObject whole = parse_crs(context, source);
  const ProjObject from = whole ? crs_part(context, whole.get(), 0) : nullptr;
  if (!from) return {};
  const bool geocentric = is_geocentric(from.get());
  // The plane degrees of the same datum.
  const ProjObject datum(proj_crs_get_datum_forced(context, from.get()));
  const ProjObject degrees(proj_create_ellipsoidal_2D_cs(context, PJ_ELLPS2D_LATITUDE_LONGITUDE, nullptr, 0));
  ProjObject geographic = geocentric ? nullptr : plane_part(context, whole.get());
  if (geocentric)
    geographic.reset(
        proj_create_geographic_crs_from_datum(context, proj_get_name(from.get()), datum.get(), degrees.get()));
  if (!geographic) return {};
  PJ_COORD at = proj_coord(place[0], place[1], place[2], 0);
  const ProjObject way = way_between(context, from.get(), geographic.get());
  if (!way) return {};
  at = proj_trans(way.get(), PJ_FWD, at);
  if (!std::isfinite(at.xy.x) || !std::isfinite(at.xy.y) || std::abs(at.xy.y) > 84) return {};
  const int zone = std::clamp(static_cast<int>(std::floor((at.xy.x + 180) / 6)) + 1, 1, 60);
  const ProjObject conversion(proj_create_conversion_utm(context, zone, at.xy.y >= 0));
  const ProjObject plane(proj_create_cartesian_2D_cs(context, PJ_CART2D_EASTING_NORTHING, "metre", 1));
  const std::string name =
      std::string(proj_get_name(geographic.get())) + " / UTM zone " + std::to_string(zone) + (at.xy.y >= 0 ? "N" : "S");
  ProjObject utm(proj_create_projected_crs(context, name.c_str(), geographic.get(), conversion.get(), plane.get()));
  if (!utm) return {};
  // With its EPSG code where it has one.
  int* confidence = nullptr;
  PJ_OBJ_LIST* known = proj_identify(context, utm.get(), "EPSG", nullptr, &confidence);
  if (known && proj_list_get_count(known) > 0 && confidence[0] >= 70) utm.reset(proj_list_get(context, known, 0));
  proj_int_list_destroy(confidence);
  proj_list_destroy(known);
  if (geocentric) utm.reset(proj_crs_promote_to_3D(context, nullptr, utm.get()));
  const char* wkt = utm ? proj_as_wkt(context, utm.get(), PJ_WKT2_2019, nullptr) : nullptr;
  return wkt == nullptr ? std::string() : wkt;
}

}  // namespace btms
