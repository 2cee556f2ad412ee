// Eigenvalues of symmetric positive semi-definite 3x3 matrices, four at once, and the eigenvectors of the smallest
// ones, by Newton steps on the characteristic polynomial: +, *, / and sqrt only, so the bits are the same on every CPU
// and at every optimisation level. Eigen's solvers are faster to write and change bits with compiler flags.
//
// Accuracy: eigenvalues within 1e-9 of the largest where they stand apart, 1e-6 where two of them coincide and 1e-4 in
// a ball (a double root is known to half the digits, a triple one to a third; a fixed-order Jacobi in the tests is the
// oracle).
#pragma once

#include "engine/lattice/lanes.h"

namespace btms {

struct SymmetricMatrices {
  Lanes xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
};

struct EigenSystems {
  Lanes l1{}, l2{}, l3{};  // descending, l3 >= 0
  // Unit eigenvector of l3, z >= 0; (0, 0, 1) where it is not determined.
  Lanes normal_x{}, normal_y{}, normal_z{};
};

// Total: a trace that is not positive (or not a number) gives all zeros.
BTMS_INLINE EigenSystems solve_eigen(const SymmetricMatrices& m) {
  const Lanes trace = m.xx + m.yy + m.zz;
  const LongLanes solvable = trace > 0.0;
  const Lanes scale = solvable ? 1.0 / trace : Lanes{};
  const Lanes xx = solvable ? m.xx * scale : Lanes{}, xy = solvable ? m.xy * scale : Lanes{};
  const Lanes xz = solvable ? m.xz * scale : Lanes{}, yy = solvable ? m.yy * scale : Lanes{};
  const Lanes yz = solvable ? m.yz * scale : Lanes{}, zz = solvable ? m.zz * scale : Lanes{};
  const Lanes xy2 = xy * xy, xz2 = xz * xz, yz2 = yz * yz;

  // lambda^3 - lambda^2 + minors lambda - det = 0. Started at 0, Newton climbs monotonically to the smallest root.
  const Lanes minors = xx * yy + xx * zz + yy * zz - xy2 - xz2 - yz2;
  const Lanes det = xx * (yy * zz - yz2) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy);
  // It never passes the polynomial's left critical point, where the slope vanishes: there two roots coincide.
  const Lanes critical = (1.0 - sqrt_lanes(max_lanes(1.0 - 3.0 * minors, Lanes{}))) / 3.0;
  Lanes x{};
  for (int i = 0; i < 64; ++i) {
    const Lanes f = ((-x + 1.0) * x - minors) * x + det;
    const Lanes slope = (-3.0 * x + 2.0) * x - minors;
    const Lanes newton = x - f / slope, next = newton < critical ? newton : critical;
    const LongLanes climbs = (slope < -1e-300) & (next > x);
    if (!any_lane(climbs)) break;
    x = climbs ? next : x;  // a lane that stands still stays where it is
  }

  // The other two roots from the deflated quadratic.
  const Lanes sum = 1.0 - x, product = minors - x * sum;
  const Lanes root = sqrt_lanes(max_lanes(sum * sum * 0.25 - product, Lanes{}));
  const Lanes size = solvable ? trace : Lanes{};
  EigenSystems e;
  e.l1 = (0.5 * sum + root) * size;
  e.l2 = max_lanes(0.5 * sum - root, Lanes{}) * size;
  e.l3 = x * size;

  // Rows of (M - x I) span the plane across the eigenvector: the longest of their cross products is the stable one.
  const Lanes a = xx - x, b = yy - x, c = zz - x;
  const Lanes ux = xy * yz - xz * b, uy = xz * xy - a * yz, uz = a * b - xy2;
  const Lanes vx = xy * c - xz * yz, vy = xz2 - a * c, vz = a * yz - xz * xy;
  const Lanes wx = b * c - yz2, wy = yz * xz - xy * c, wz = xy * yz - b * xz;
  const Lanes uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz, ww = wx * wx + wy * wy + wz * wz;
  const LongLanes u_best = (uu >= vv) & (uu >= ww), v_best = ~u_best & (vv >= ww) & (uu < vv);
  const Lanes length2 = max_lanes(max_lanes(ww, vv), uu);
  const LongLanes known = length2 > 1e-60;
  const Lanes up = u_best ? uz : v_best ? vz : wz;
  const Lanes unit = known ? 1.0 / sqrt_lanes(length2) : Lanes{};
  const Lanes outward = up * unit < 0.0 ? -unit : unit;
  e.normal_x = (u_best ? ux : v_best ? vx : wx) * outward;
  e.normal_y = (u_best ? uy : v_best ? vy : wy) * outward;
  e.normal_z = known ? up * outward : Lanes{} + 1.0;
  return e;
}

}  // namespace btms
