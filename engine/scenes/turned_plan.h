// A plan that is turned against the axes of the map by the exact angle of the 5-12-13 triangle, so that nothing in it
// lies along rows of pulses or lattice cells.
#pragma once

#include "engine/scenes/object.h"

namespace btms {

struct PlanPlace {
  double u_m = 0, v_m = 0;
};

inline constexpr double kPlanCos = 12.0 / 13, kPlanSin = 5.0 / 13;

constexpr PlanPlace to_plan(double x_m, double y_m) {
  return {kPlanCos * x_m + kPlanSin * y_m, kPlanCos * y_m - kPlanSin * x_m};
}

// The frame at a place of the plan: s along u, t along v.
constexpr Frame plan_frame(double u_m, double v_m) {
  return {kPlanCos * u_m - kPlanSin * v_m, kPlanSin * u_m + kPlanCos * v_m, kPlanCos, kPlanSin, -kPlanSin, kPlanCos};
}

// The range of the plan that a box of the map covers.
inline Box plan_box(const Box& box) {
  const double x = (box.x0_m + box.x1_m) / 2, y = (box.y0_m + box.y1_m) / 2;
  const double dx = box.x1_m - x, dy = box.y1_m - y;
  const PlanPlace p = to_plan(x, y);
  const double du = kPlanCos * dx + kPlanSin * dy, dv = kPlanCos * dy + kPlanSin * dx;
  return {p.u_m - du, p.v_m - dv, p.u_m + du, p.v_m + dv};
}

}  // namespace btms
