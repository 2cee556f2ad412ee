// Coordinates from one reference system to another, through PROJ.
//
// Points are moved before they are rounded to millimetres. PROJ computes with the system's libm and whatever grids are
// installed: the result is the same on one machine, and nearly (below a millimetre) on another.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

namespace btms {

// Thread-safe.
class Reprojection {
 public:
  virtual ~Reprojection() = default;
  // In place. What has no place in the target becomes infinite. Heights stay what they are, unless the source is
  // geocentric: then they are above the target's ellipsoid.
  virtual void apply(double* x, double* y, double* z, std::size_t n) const = 0;
};

// x is east or longitude, y north or latitude, in the units of the systems; `target` is projected, in metres. Throws
// Error(kUsage) when PROJ knows no way.
std::unique_ptr<Reprojection> reprojection(const std::string& source, const std::string& target);

// The UTM zone of a place that is given in a geographic or geocentric system, over the same datum, as WKT; a geocentric
// source gives one with ellipsoidal heights. Empty when PROJ can't say.
std::string utm_of(const std::string& source, const std::array<double, 3>& place);

}  // namespace btms
