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

struct Box {
  std::int64_t min_x, min_y, max_x, max_y;  // mm
};

constexpr std::int64_t kMostReach_mm = std::int64_t{1} << 29;  // products of offsets fit 64 bits

void check_radius(double radius_m) {
  if (!(radius_m >= 0)) throw Error(ErrorCode::kUsage, "a radius is a number of metres, not below zero");
}
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
  answer.hazard = hazard;
  answer.at = place;
  return answer;
}
CheckAnswer safe(double worst) {
  CheckAnswer answer;
  answer.safe = true;
  answer.traversability = 1 - worst;
  return answer;
}
// Returns whether all is safe yet.
bool add(CheckAnswer& all, const CheckAnswer& next) {
  const double before = all.traversability;
  all = next;
  all.traversability = std::min(before, next.traversability);
  return all.safe;
}

Place centroid(const Lattice& lattice, NodeId id) {
  const std::int64_t r_mm = lattice.resolution_mm();
  return {static_cast<double>(3 * lattice.centre_x_mm(id.cell) + centroid_x3(id.triangle, r_mm)) / 3000,
          static_cast<double>(3 * lattice.centre_y_mm(id.cell) + centroid_y3(id.triangle, r_mm)) / 3000};
}

// Row by row from the south, so that the first hazard doesn't depend on how the map is cut into tiles.
template <class Shape>
CheckAnswer check(TileCursor& cursor, const Lattice& lattice, const Shape& shape, const HazardRules& rules) {
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
        const HazardRules::Verdict verdict = tile ? rules.of(*tile, {cell, t}) : rules.outside();
        const Hazard hazard = !tile && cursor.damaged() ? Hazard::kDamaged : verdict.hazard;
        if (hazard != Hazard::kNone) return unsafe(hazard, centroid(lattice, {cell, t}));
        worst = std::max(worst, verdict.share);
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
        rules_(limits, lattice_.resolution_mm()),
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
    if (!on_plane(place)) return add(answer_, unsafe(Hazard::kOutside, place));
    for (std::size_t i = 0; i < footprint_.size(); ++i) {
      const Place f = footprint_[i];
      polygon_.all[i] = to_mm(Place{place.x_m + heading.cos * f.x_m - heading.sin * f.y_m,
                                    place.y_m + heading.sin * f.x_m + heading.cos * f.y_m});
    }
    return add(answer_, check(cursor_, lattice_, polygon_, rules_));
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

  Lattice lattice_;
  TileCursor cursor_;
  HazardRules rules_;
  std::span<const Place> footprint_;
  double reach_m_ = 0;
  Polygon polygon_;
  CheckAnswer answer_ = safe(0);
};

}  // namespace

CheckAnswer check_disc(const Terrain& terrain, Place centre, double radius_m, const VehicleLimits& limits) {
  check_radius(radius_m);
  check_reach(radius_m);
  if (!on_plane(centre)) return unsafe(Hazard::kOutside, centre);
  const Lattice lattice = terrain.layout().lattice;
  TileCursor cursor(terrain.tiles());
  return check(cursor, lattice, Disc{to_mm(centre), to_mm(radius_m)}, HazardRules(limits, lattice.resolution_mm()));
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
  return check(cursor, lattice, shape, HazardRules(limits, lattice.resolution_mm()));
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

// What lies between two discs is a rectangle; pieces of it, so that the first hazard is one of the first piece.
CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, double radius_m,
                       const VehicleLimits& limits) {
  if (path.empty()) throw Error(ErrorCode::kUsage, "a path to check needs a place");
  check_radius(radius_m);
  check_reach(radius_m);
  const Lattice lattice = terrain.layout().lattice;
  const double r_m = lattice.resolution_m(), edge = 2 * radius_m / r_m + 4;
  double pieces = static_cast<double>(path.size());
  for (std::size_t i = 1; i < path.size(); ++i)
    if (on_plane(path[i - 1]) && on_plane(path[i]))
      pieces += std::hypot(path[i].x_m - path[i - 1].x_m, path[i].y_m - path[i - 1].y_m) / r_m + 1;
  check_work(pieces * edge * edge * 4);

  TileCursor cursor(terrain.tiles());
  const HazardRules rules(limits, lattice.resolution_mm());
  CheckAnswer all = safe(0);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Place to = path[i];
    if (!on_plane(to)) return unsafe(Hazard::kOutside, to);
    if (i > 0 && to != path[i - 1]) {
      const Place from = path[i - 1];
      const double dx_m = to.x_m - from.x_m, dy_m = to.y_m - from.y_m, way_m = std::hypot(dx_m, dy_m);
      const double left_x = -dy_m / way_m * radius_m, left_y = dx_m / way_m * radius_m, n = std::ceil(way_m / r_m);
      Polygon piece;
      piece.count = 4;
      for (double k = 0; k < n; ++k) {
        const Place a{from.x_m + k / n * dx_m, from.y_m + k / n * dy_m};
        const Place b{from.x_m + (k + 1) / n * dx_m, from.y_m + (k + 1) / n * dy_m};
        piece.all[0] = to_mm(Place{a.x_m - left_x, a.y_m - left_y});
        piece.all[1] = to_mm(Place{b.x_m - left_x, b.y_m - left_y});
        piece.all[2] = to_mm(Place{b.x_m + left_x, b.y_m + left_y});
        piece.all[3] = to_mm(Place{a.x_m + left_x, a.y_m + left_y});
        if (!add(all, check(cursor, lattice, piece, rules))) return all;
      }
    }
    if (!add(all, check(cursor, lattice, Disc{to_mm(to), to_mm(radius_m)}, rules))) return all;
  }
  return all;
}

}  // namespace btms
