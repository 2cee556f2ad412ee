// Eigenvalues of a symmetric positive semi-definite 3x3 matrix and the eigenvector of the smallest one, by Newton steps
// on the characteristic polynomial: +, *, / and sqrt only, so the bits are the same on every CPU and at every
// optimisation level. Eigen's solvers are faster to write and change bits with compiler flags.
//
// Accuracy: eigenvalues within 1e-9 of the largest where they stand apart, 1e-6 where two of them coincide and 1e-4 in
// a ball (a double root is known to half the digits, a triple one to a third; a fixed-order Jacobi in the tests is the
// oracle).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace btms {

struct SymmetricMatrix {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
};

struct EigenSystem {
  double l1 = 0, l2 = 0, l3 = 0;    // descending, l3 >= 0
  Eigen::Vector3d normal{0, 0, 1};  // unit eigenvector of l3, z >= 0; (0, 0, 1) where it is not determined
};

// Total: a zero (or not positive) trace gives all zeros.
inline EigenSystem solve_eigen(const SymmetricMatrix& m) {
  EigenSystem e;
  const double trace = m.xx + m.yy + m.zz;
  if (!(trace > 0)) return e;
  const double scale = 1 / trace;
  const double xx = m.xx * scale, xy = m.xy * scale, xz = m.xz * scale;
  const double yy = m.yy * scale, yz = m.yz * scale, zz = m.zz * scale;
  const double xy2 = xy * xy, xz2 = xz * xz, yz2 = yz * yz;

  // lambda^3 - lambda^2 + minors lambda - det = 0. Started at 0, Newton climbs monotonically to the smallest root.
  const double minors = xx * yy + xx * zz + yy * zz - xy2 - xz2 - yz2;
  const double det = xx * (yy * zz - yz2) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy);
  // It never passes the polynomial's left critical point, where the slope vanishes: there two roots coincide.
  const double critical = (1 - std::sqrt(std::max(0.0, 1 - 3 * minors))) / 3;
  double x = 0;
  for (int i = 0; i < 64; ++i) {
    const double f = ((-x + 1) * x - minors) * x + det;
    const double slope = (-3 * x + 2) * x - minors;
    if (!(slope < -1e-300)) break;
    const double next = std::min(x - f / slope, critical);
    if (!(next > x)) break;
    x = next;
  }

  // The other two roots from the deflated quadratic.
  const double sum = 1 - x, product = minors - x * sum;
  const double root = std::sqrt(std::max(0.0, sum * sum * 0.25 - product));
  e.l1 = (0.5 * sum + root) * trace;
  e.l2 = std::max(0.0, 0.5 * sum - root) * trace;
  e.l3 = x * trace;

  // Rows of (M - x I) span the plane across the eigenvector: the longest of their cross products is the stable one.
  const double a = xx - x, b = yy - x, c = zz - x;
  const Eigen::Vector3d u{xy * yz - xz * b, xz * xy - a * yz, a * b - xy2};
  const Eigen::Vector3d v{xy * c - xz * yz, xz2 - a * c, a * yz - xz * xy};
  const Eigen::Vector3d w{b * c - yz2, yz * xz - xy * c, xy * yz - b * xz};
  // Written out: the order of Eigen's own sum depends on its vectorisation.
  const auto length2_of = [](const Eigen::Vector3d& s) { return s.x() * s.x() + s.y() * s.y() + s.z() * s.z(); };
  const double uu = length2_of(u), vv = length2_of(v), ww = length2_of(w);
  const Eigen::Vector3d& best = uu >= vv ? (uu >= ww ? u : w) : (vv >= ww ? v : w);
  const double length2 = std::max(uu, std::max(vv, ww));
  if (!(length2 > 1e-60)) return e;
  e.normal = best * (1 / std::sqrt(length2));
  if (e.normal.z() < 0) e.normal = -e.normal;
  return e;
}

}  // namespace btms
