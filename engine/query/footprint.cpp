#include "engine/query/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "engine/query/shape.h"

namespace btms {
namespace {

constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;

// Where a map can be.
bool is_on_plane(Place p) { return std::abs(p.x_m) <= kLimit_m && std::abs(p.y_m) <= kLimit_m; }

// A node's corners in metres about its square's centre, counter-clockwise.
std::array<TrianglePlaces, kTriangles> triangles_about_centre(double r_m) {
  std::array<TrianglePlaces, kTriangles> out;
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    const auto corners = triangle_corners(t);
    for (std::size_t c = 0; c < 3; ++c) out[t][c] = {(corners[c].x - 1) * r_m / 2, (corners[c].y - 1) * r_m / 2};
  }
  return out;
}

class Checker {
 public:
  Checker(const Terrain& terrain, const VehicleLimits& limits)
      : terrain_(terrain),
        lattice_(terrain.layout().lattice),
        rules_(limits, lattice_.resolution_mm()),
        triangles_(triangles_about_centre(lattice_.resolution_m())) {}

  double r_m() const { return lattice_.resolution_m(); }

  template <class Shape>
  CheckAnswer check(const Shape& shape) {
    const CellBox cells = cells_of(shape.bounds());
    const Place middle = shape.middle();
    CheckAnswer answer{true, 1, Hazard::kNone, {}};
    double nearest = std::numeric_limits<double>::infinity();
    double worst = 0;
    for (std::int32_t row = cells.row0; row < cells.row1; ++row)
      for (std::int32_t col = cells.col0; col < cells.col1; ++col) {
        const Cell cell{col, row};
        const Place centre{static_cast<double>(lattice_.centre_x_mm(cell)) / 1000,
                           static_cast<double>(lattice_.centre_y_mm(cell)) / 1000};
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          if (!shape.touches(triangles_[t], centre)) continue;
          const HazardRules::Verdict verdict = of({cell, t});
          worst = std::max<double>(worst, verdict.share);
          if (verdict.hazard == Hazard::kNone) continue;
          const double r = r_m();
          const Place at{centre.x_m + (t == kEast   ? r / 3
                                       : t == kWest ? -r / 3
                                                    : 0),
                         centre.y_m + (t == kNorth   ? r / 3
                                       : t == kSouth ? -r / 3
                                                     : 0)};
          const double dx = at.x_m - middle.x_m, dy = at.y_m - middle.y_m, distance = dx * dx + dy * dy;
          if (distance >= nearest) continue;
          nearest = distance;
          answer = {false, 0, verdict.hazard, at};
        }
      }
    if (answer.safe) answer.traversability = std::clamp(1 - worst, 0.0, 1.0);
    return answer;
  }

 private:
  CellBox cells_of(const PlaneBox& box) const {
    const double squares = ((box.max_x_m - box.min_x_m) / r_m() + 2) * ((box.max_y_m - box.min_y_m) / r_m() + 2);
    if (!(squares <= kMaxCheckSquares)) throw Error(ErrorCode::kUsage, "the shape to check is too large");
    const auto mm = [](double m) {
      return static_cast<std::int64_t>(std::floor(std::clamp(m, -kLimit_m, kLimit_m) * 1000));
    };
    // A place on the border of two squares touches both.
    const Cell low = lattice_.cell_at(mm(box.min_x_m) - 1, mm(box.min_y_m) - 1);
    const Cell high = lattice_.cell_at(mm(box.max_x_m) + 1, mm(box.max_y_m) + 1);
    return {low.col, low.row, high.col + 1, high.row + 1};
  }

  HazardRules::Verdict of(NodeId id) {
    if (!inside_.contains(id.cell)) {
      const TileGrid& grid = terrain_.layout().grid;
      const TileId tile = grid.tile_of(id.cell);
      inside_ = {};
      try {
        pin_ = {};
        pin_ = terrain_.tiles().pin(tile);
      } catch (...) {
        return {Hazard::kDamaged, 0};
      }
      inside_ = grid.box_of(tile);
    }
    return pin_ && pin_->box.contains(id.cell) ? rules_.of(*pin_, id) : rules_.outside();
  }

  const Terrain& terrain_;
  const Lattice lattice_;
  const HazardRules rules_;
  const std::array<TrianglePlaces, kTriangles> triangles_;
  TileCache::Pin pin_;
  CellBox inside_;  // of the tile that is pinned
};

CheckAnswer nowhere(Place at) { return {false, 0, Hazard::kOutside, at}; }

// Poses along a path: fn(place, direction x, y) returns false to stop.
template <class Fn>
void along(std::span<const Place> path, double spacing_m, const Fn& fn) {
  double length_m = 0;
  for (std::size_t i = 1; i < path.size(); ++i)
    length_m += std::hypot(path[i].x_m - path[i - 1].x_m, path[i].y_m - path[i - 1].y_m);
  if (!(length_m / spacing_m + static_cast<double>(path.size()) <= static_cast<double>(kMaxCheckPoses)))
    throw Error(ErrorCode::kUsage, "the path to check is too long");
  if (path.size() == 1) fn(path[0], 1, 0);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double dx = path[i].x_m - path[i - 1].x_m, dy = path[i].y_m - path[i - 1].y_m, leg = std::hypot(dx, dy);
    if (leg == 0 && path.size() > 2) continue;
    const double ux = leg > 0 ? dx / leg : 1, uy = leg > 0 ? dy / leg : 0;
    const auto steps = static_cast<std::size_t>(std::max(1.0, std::ceil(leg / spacing_m)));
    for (std::size_t k = 0; k <= steps; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(steps);
      if (!fn(Place{path[i - 1].x_m + share * dx, path[i - 1].y_m + share * dy}, ux, uy)) return;
    }
  }
}

template <class At>
CheckAnswer check_along(Checker& checker, std::span<const Place> path, const At& at) {
  if (path.empty()) throw Error(ErrorCode::kUsage, "a path has at least one place");
  for (const Place& p : path)
    if (!is_on_plane(p)) return nowhere(p);
  CheckAnswer all{true, 1, Hazard::kNone, {}};
  along(path, checker.r_m() / 2, [&](Place place, double ux, double uy) {
    const CheckAnswer one = at(place, ux, uy);
    if (!one.safe) all = one;
    all.traversability = std::min(all.traversability, one.traversability);
    return one.safe;
  });
  return all;
}

void check_polygon_size(std::span<const Place> polygon) {
  if (polygon.size() < 3) throw Error(ErrorCode::kUsage, "a polygon has at least three places");
}

}  // namespace

CheckAnswer check_disc(const Terrain& terrain, Place centre, double radius_m, const VehicleLimits& limits) {
  if (!is_on_plane(centre)) return nowhere(centre);
  if (!(radius_m >= 0)) throw Error(ErrorCode::kUsage, "a radius is a number of metres, not below zero");
  return Checker(terrain, limits).check(Disc{centre, radius_m});
}

CheckAnswer check_polygon(const Terrain& terrain, std::span<const Place> polygon, const VehicleLimits& limits) {
  check_polygon_size(polygon);
  for (const Place& p : polygon)
    if (!is_on_plane(p)) return nowhere(p);
  return Checker(terrain, limits).check(Polygon{polygon});
}

CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, double radius_m,
                       const VehicleLimits& limits) {
  if (!(radius_m >= 0)) throw Error(ErrorCode::kUsage, "a radius is a number of metres, not below zero");
  Checker checker(terrain, limits);
  return check_along(checker, path, [&](Place p, double, double) { return checker.check(Disc{p, radius_m}); });
}

CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, std::span<const Place> footprint,
                       const VehicleLimits& limits) {
  check_polygon_size(footprint);
  for (const Place& p : footprint)
    if (!is_on_plane(p)) throw Error(ErrorCode::kUsage, "a footprint's places are numbers of metres");
  Checker checker(terrain, limits);
  std::vector<Place> turned(footprint.size());
  return check_along(checker, path, [&](Place p, double ux, double uy) {
    for (std::size_t i = 0; i < footprint.size(); ++i)
      turned[i] = {p.x_m + ux * footprint[i].x_m - uy * footprint[i].y_m,
                   p.y_m + uy * footprint[i].x_m + ux * footprint[i].y_m};
    return checker.check(Polygon{turned});
  });
}

}  // namespace btms
