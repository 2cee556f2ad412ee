#include "engine/query/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "engine/error.h"
#include "engine/query/overlap.h"
#include "engine/query/tile_cursor.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

double share_of(double value, double limit) {
  if (!(limit >= 0)) return std::numeric_limits<double>::infinity();
  return value == 0 ? 0 : value / limit;
}

// Limits in the units of the layers.
class Judge {
 public:
  Judge(const VehicleLimits& limits, double r_mm)
      : limits_(limits),
        steepest_rise_mm_(rise_mm(limits.slope_deg, r_mm)),
        step_mm_(limits.step_m * 1000),
        roughness_mm_(limits.roughness_m * 1000),
        clearance_mm_(limits.clearance_m * 1000),
        rough_has_limit_(!(limits.roughness_m == std::numeric_limits<double>::infinity())) {}

  // Raises `worst` to the node's share of a limit.
  Hazard judge(const TerrainTile& tile, NodeId id, double& worst) const {
    const NodeSurface& node = tile.nodes[tile.node_index(id)];
    if (node.state == NodeState::kObstacle) return Hazard::kObstacle;
    if (node.state == NodeState::kUnknown || node.state == NodeState::kFilled ||
        (node.state == NodeState::kPredicted && !limits_.predicted_is_safe))
      return nothing_known();
    const auto rise2 = static_cast<double>(FinalPlane::through(id.triangle, tile.corners_mm(id)).rise2_mm2());
    const double slope = share_of(std::sqrt(rise2), steepest_rise_mm_);
    if (!(slope <= 1)) return Hazard::kSlope;
    const double step = share_of(node.step_mm, step_mm_);
    if (!(step <= 1)) return Hazard::kStep;
    const double rough = rough_has_limit_ ? share_of(node.roughness_mm, roughness_mm_)
                                          : std::min(1.0, share_of(2 * node.roughness_mm, step_mm_));
    if (!(rough <= 1)) return Hazard::kRoughness;
    if (node.clearance_mm != kNothingAbove && !(node.clearance_mm >= clearance_mm_)) return Hazard::kClearance;
    worst = std::max({worst, slope, step, rough});
    return Hazard::kNone;
  }
  Hazard nothing_known() const { return limits_.unknown_is_safe ? Hazard::kNone : Hazard::kUnknown; }
  Hazard no_map() const { return limits_.unknown_is_safe ? Hazard::kNone : Hazard::kOutside; }

 private:
  static double rise_mm(double slope_deg, double r_mm) {
    if (slope_deg >= 90) return std::numeric_limits<double>::infinity();
    return slope_deg >= 0 ? r_mm * sine(radians(slope_deg)) / cosine(radians(slope_deg))
                          : std::numeric_limits<double>::quiet_NaN();
  }

  VehicleLimits limits_;
  double steepest_rise_mm_, step_mm_, roughness_mm_, clearance_mm_;
  bool rough_has_limit_;
};

struct Box {
  std::int64_t min_x, min_y, max_x, max_y;  // mm
};

constexpr std::int64_t kMostReach_mm = std::int64_t{1} << 29;  // products of offsets fit 64 bits

void check_reach(double reach_m) {
  if (!(reach_m * 1000 <= static_cast<double>(kMostReach_mm)))
    throw Error(ErrorCode::kUsage, "the shape to check reaches " + std::to_string(reach_m) + " m, which is no vehicle");
}
void check_work(double work) {
  if (!(work <= kMostCheckWork)) throw Error(ErrorCode::kUsage, "too much to check at once; check it in pieces");
}

// The squares that share a point with the box.
CellBox squares_of(const Lattice& lattice, const Box& box) {
  const Cell low = lattice.cell_at(box.min_x - 1, box.min_y - 1), high = lattice.cell_at(box.max_x, box.max_y);
  return {low.col, low.row, high.col + 1, high.row + 1};
}

struct Disc {
  PlaceMm centre;
  std::int64_t radius_mm;

  Box box() const { return {centre.x - radius_mm, centre.y - radius_mm, centre.x + radius_mm, centre.y + radius_mm}; }
  double vertices() const { return 4; }
  TriangleMask mask(PlaceMm o, std::int64_t h) const {
    return triangles_on_disc({centre.x - o.x, centre.y - o.y}, radius_mm, h);
  }
};

struct Polygon {
  std::size_t count = 0;
  std::array<PlaceMm, kMostVertices> all;

  Box box() const {
    Box b{all[0].x, all[0].y, all[0].x, all[0].y};
    for (std::size_t i = 1; i < count; ++i)
      b = {std::min(b.min_x, all[i].x), std::min(b.min_y, all[i].y), std::max(b.max_x, all[i].x),
           std::max(b.max_y, all[i].y)};
    return b;
  }
  double vertices() const { return static_cast<double>(count); }
  TriangleMask mask(PlaceMm o, std::int64_t h) const {
    return triangles_on_polygon(
        count,
        [&](std::size_t i) {
          return PlaceMm{all[i].x - o.x, all[i].y - o.y};
        },
        h);
  }
};

CheckAnswer unsafe(Hazard hazard, Place place) {
  CheckAnswer answer;
  answer.first = hazard;
  answer.first_bad = place;
  return answer;
}
CheckAnswer safe(double worst) {
  CheckAnswer answer;
  answer.safe = true;
  answer.traversability = 1 - worst;
  return answer;
}

Place centroid(const Lattice& lattice, NodeId id) {
  const std::int64_t r_mm = lattice.resolution_mm();
  return {static_cast<double>(3 * lattice.centre_x_mm(id.cell) + centroid_x3(id.triangle, r_mm)) / 3000,
          static_cast<double>(3 * lattice.centre_y_mm(id.cell) + centroid_y3(id.triangle, r_mm)) / 3000};
}

// Row by row from the south, so that the first hazard doesn't depend on how the map is cut into tiles.
template <class Shape>
CheckAnswer check(TileCursor& cursor, const Lattice& lattice, const Shape& shape, const Judge& judge) {
  const std::int64_t h = lattice.resolution_mm() / 2;
  const Box box = shape.box();
  check_reach(static_cast<double>(std::max(box.max_x - box.min_x, box.max_y - box.min_y)) / 2000);
  const CellBox squares = squares_of(lattice, box);
  check_work(static_cast<double>(squares.cells()) * shape.vertices());
  double worst = 0;
  Cell cell;
  for (cell.row = squares.row0; cell.row < squares.row1; ++cell.row)
    for (cell.col = squares.col0; cell.col < squares.col1; ++cell.col) {
      const TriangleMask mask = shape.mask({lattice.centre_x_mm(cell), lattice.centre_y_mm(cell)}, h);
      if (mask == 0) continue;
      const TerrainTile* tile = cursor.at(cell);
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        if (!(mask >> t & 1)) continue;
        const Hazard hazard = tile               ? judge.judge(*tile, {cell, t}, worst)
                              : cursor.damaged() ? Hazard::kDamaged
                                                 : judge.no_map();
        if (hazard != Hazard::kNone) return unsafe(hazard, centroid(lattice, {cell, t}));
      }
    }
  return safe(worst);
}

void check_vertices(std::span<const Place> polygon) {
  if (polygon.size() > kMostVertices)
    throw Error(ErrorCode::kUsage, "a polygon to check has at most " + std::to_string(kMostVertices) + " vertices");
  const auto end = polygon.end();
  const auto second = std::find_if(polygon.begin(), end, [&](const Place& p) { return p != polygon[0]; });
  if (std::find_if(second, end, [&](const Place& p) { return p != polygon[0] && p != *second; }) == end)
    throw Error(ErrorCode::kUsage, "a polygon to check needs three different vertices");
}

struct Heading {
  double cos = 1, sin = 0;
};
Heading heading_of(double yaw_rad) { return {std::cos(yaw_rad), std::sin(yaw_rad)}; }
Heading turned(Heading h, Heading by) { return {h.cos * by.cos - h.sin * by.sin, h.sin * by.cos + h.cos * by.sin}; }

// A footprint that goes from pose to pose, and what it has met so far.
class MovingFootprint {
 public:
  MovingFootprint(const Terrain& terrain, std::span<const Place> footprint, const VehicleLimits& limits)
      : lattice_(terrain.layout().lattice),
        cursor_(terrain.tiles()),
        judge_(limits, lattice_.resolution_mm()),
        footprint_(footprint) {
    check_vertices(footprint);
    for (const Place& p : footprint) {
      const double distance_m = std::hypot(p.x_m, p.y_m);
      check_reach(distance_m);
      reach_m_ = std::max(reach_m_, distance_m);
    }
    polygon_.count = footprint.size();
  }

  // Everything it does returns whether it is still safe.
  bool stand(Place place, Heading heading) {
    if (!on_plane(place)) return is_safe(unsafe(Hazard::kOutside, place));
    for (std::size_t i = 0; i < footprint_.size(); ++i) {
      const Place f = footprint_[i];
      polygon_.all[i] = to_mm(Place{place.x_m + heading.cos * f.x_m - heading.sin * f.y_m,
                                    place.y_m + heading.sin * f.x_m + heading.cos * f.y_m});
    }
    return is_safe(check(cursor_, lattice_, polygon_, judge_));
  }
  bool go(Place from, Place to, Heading heading) {
    const double poses = poses_for(std::hypot(to.x_m - from.x_m, to.y_m - from.y_m));
    for (double k = 0; k <= poses; ++k) {
      const double part = k / poses;
      if (!stand({from.x_m + part * (to.x_m - from.x_m), from.y_m + part * (to.y_m - from.y_m)}, heading)) return false;
    }
    return true;
  }
  // Without the first and the last pose.
  bool turn(Place place, Heading from, Heading to) {
    const double angle = std::atan2(from.cos * to.sin - from.sin * to.cos, from.cos * to.cos + from.sin * to.sin);
    const double poses = poses_for(std::abs(angle) * reach_m_);
    for (double k = 1; k < poses; ++k)
      if (!stand(place, turned(from, heading_of(angle * k / poses)))) return false;
    return true;
  }

  // Throws when this would be too much work.
  void prepare_for(std::span<const Place> path) const {
    double poses = 1;
    for (std::size_t i = 1; i < path.size(); ++i)
      if (on_plane(path[i - 1]) && on_plane(path[i]))
        poses += poses_for(std::hypot(path[i].x_m - path[i - 1].x_m, path[i].y_m - path[i - 1].y_m)) + 1 +
                 poses_for(kPi * reach_m_);
    const double edge = 2 * reach_m_ / lattice_.resolution_m() + 3;
    check_work(poses * edge * edge * polygon_.vertices());
  }

  const CheckAnswer& answer() const { return answer_; }

 private:
  double poses_for(double way_m) const { return std::max(1.0, std::ceil(way_m / (lattice_.resolution_m() / 2))); }
  bool is_safe(const CheckAnswer& now) {
    const double before = answer_.traversability;
    answer_ = now;
    answer_.traversability = std::min(before, now.traversability);
    return now.safe;
  }

  Lattice lattice_;
  TileCursor cursor_;
  Judge judge_;
  std::span<const Place> footprint_;
  double reach_m_ = 0;
  Polygon polygon_;
  CheckAnswer answer_ = safe(0);
};

}  // namespace

VehicleLimits limits_of(const Parameters& parameters) {
  VehicleLimits limits;
  limits.slope_deg = parameters.vehicle_max_slope_deg;
  limits.step_m = parameters.vehicle_max_step_m;
  limits.clearance_m = parameters.vehicle_height_m;
  return limits;
}

const char* hazard_name(Hazard hazard) {
  switch (hazard) {
    case Hazard::kSlope:
      return "slope";
    case Hazard::kStep:
      return "step";
    case Hazard::kRoughness:
      return "roughness";
    case Hazard::kClearance:
      return "clearance";
    case Hazard::kObstacle:
      return "obstacle";
    case Hazard::kUnknown:
      return "unknown";
    case Hazard::kOutside:
      return "outside";
    case Hazard::kDamaged:
      return "damaged";
    case Hazard::kNone:
      break;
  }
  return "none";
}

CheckAnswer check_disc(const Terrain& terrain, Place centre, double radius_m, const VehicleLimits& limits) {
  if (!(radius_m >= 0)) throw Error(ErrorCode::kUsage, "the radius of a disc to check is a length, 0 or more");
  check_reach(radius_m);
  if (!on_plane(centre)) return unsafe(Hazard::kOutside, centre);
  const Lattice lattice = terrain.layout().lattice;
  TileCursor cursor(terrain.tiles());
  return check(cursor, lattice, Disc{to_mm(centre), to_mm(radius_m)}, Judge(limits, lattice.resolution_mm()));
}

CheckAnswer check_polygon(const Terrain& terrain, std::span<const Place> polygon, const VehicleLimits& limits) {
  check_vertices(polygon);
  Polygon shape;
  for (const Place& p : polygon) {
    if (!on_plane(p)) return unsafe(Hazard::kOutside, p);
    shape.all[shape.count++] = to_mm(p);
  }
  const Lattice lattice = terrain.layout().lattice;
  TileCursor cursor(terrain.tiles());
  return check(cursor, lattice, shape, Judge(limits, lattice.resolution_mm()));
}

CheckAnswer check_pose(const Terrain& terrain, const Pose2& pose, std::span<const Place> footprint,
                       const VehicleLimits& limits) {
  MovingFootprint vehicle(terrain, footprint, limits);
  if (!std::isfinite(pose.yaw_rad)) return unsafe(Hazard::kOutside, pose.place);
  vehicle.stand(pose.place, heading_of(pose.yaw_rad));
  return vehicle.answer();
}

CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, std::span<const Place> footprint,
                       const VehicleLimits& limits) {
  if (path.empty()) throw Error(ErrorCode::kUsage, "a path to check needs a place");
  MovingFootprint vehicle(terrain, footprint, limits);
  vehicle.prepare_for(path);
  std::optional<Heading> heading;
  for (std::size_t i = 0; i < path.size() && vehicle.answer().safe; ++i) {
    const Place to = path[i];
    if (!on_plane(to)) return unsafe(Hazard::kOutside, to);
    if (i == 0 || to == path[i - 1]) continue;
    const Place from = path[i - 1];
    const double dx_m = to.x_m - from.x_m, dy_m = to.y_m - from.y_m, way_m = std::hypot(dx_m, dy_m);
    const Heading next{dx_m / way_m, dy_m / way_m};
    if (!heading || vehicle.turn(from, *heading, next)) vehicle.go(from, to, next);
    heading = next;
  }
  if (!heading) vehicle.stand(path[0], {});
  return vehicle.answer();
}

}  // namespace btms
