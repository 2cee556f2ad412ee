#include "apps/btms/run_plan.h"

namespace btms {
namespace {

// In nanoseconds of one thread a point. What goes with the nodes of a level is measured on the finest; a level has a
// quarter of the nodes of the next.
void add_round(RunPlan& plan, int round, double nodes, bool first, bool last) {
  if (round != 1) {
    plan.push_back({"prior", 6 * nodes});
    plan.push_back({"fit", 23 + 20 * nodes});
  }
  if (first) plan.push_back({"domain", 0});
  plan.push_back({"class", 3 * nodes});
  plan.push_back({"link", 12 * nodes});
  plan.push_back({"rim", 12 * nodes});
  plan.push_back({"verdict", 2.5 * nodes});
  if (round == 0 && !first) plan.push_back({"misfit", nodes});
  if (last && !first) {
    plan.push_back({"heights", 1.5 * nodes});
    plan.push_back({"span", 7 * nodes});
  }
  plan.push_back({"complete", 30 * nodes});
  plan.push_back({"corners", 5 * nodes});
}

RunPlan coarse_to_fine_plan(int levels) {
  RunPlan plan = {{"partition", 18}};
  double nodes = 1;
  for (int level = 1; level < levels; ++level) nodes /= 4;
  for (int level = 0; level < levels; ++level, nodes *= 4) {
    const bool first = level == 0, last = level == levels - 1;
    for (int round = 0; round < (first || last ? 1 : 3); ++round) add_round(plan, round, nodes, first, last);
  }
  const RunPlan rest = {{"spread", 19},      {"finish", 5},      {"above", 60}, {"sheets", 4},
                        {"link sheets", 12}, {"join sheets", 6}, {"upper", 3},  {"layers", 1},
                        {"layers", 10},      {"layers", 1},      {"commit", 45}};
  plan.insert(plan.end(), rest.begin(), rest.end());
  return plan;
}

}  // namespace

RunPlan build_plan(const Parameters& parameters) {
  if (parameters.method == Method::kCoarseToFine) return coarse_to_fine_plan(level_count(parameters));
  return {{"partition", 20}, {"model", 30}, {"link", 10},  {"merge", 2},  {"complete", 40},
          {"fit", 4},        {"layers", 1}, {"layers", 6}, {"layers", 1}, {"commit", 28}};
}

}  // namespace btms
