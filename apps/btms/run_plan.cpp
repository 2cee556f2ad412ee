#include "apps/btms/run_plan.h"

#include "engine/tiling/level_passes.h"

namespace btms {
namespace {

// In nanoseconds of one thread a point. What goes with the nodes of a level is measured on the finest; a level has a
// quarter of the nodes of the next.
struct Round {
  int number;
  bool first_level, last_level, last;  // last: of its level
};

void add_round(RunPlan& plan, const Round& round, double nodes, bool spans) {
  const bool follows = round.last_level && round.number > 0;
  if (round.number == 0) plan.push_back({"prior", 3 * nodes});
  if (follows) {
    plan.push_back({"misfit", 0});
    plan.push_back({"spread", 7});
  }
  if (follows || round.number % 2 == 0)
    plan.push_back({"fit", 1.5 + 42 * nodes});
  else
    plan.push_back({"class", 2.5 * nodes});
  if (round.first_level) plan.push_back({"domain", 0});
  plan.push_back({"link", 11 * nodes});
  plan.push_back({"rim", 11 * nodes});
  plan.push_back({"verdict", 2 * nodes});
  if (round.number == 0 && !round.first_level) {
    plan.push_back({"misfit", 0});
    plan.push_back({"misfit", nodes});
  }
  if (spans && round.last_level && !round.first_level && round.last) {
    plan.push_back({"heights", 1.5 * nodes});
    plan.push_back({"span", 6.5 * nodes});
  }
  plan.push_back({"complete", 31 * nodes});
  plan.push_back({"corners", 5.5 * nodes});
}

RunPlan coarse_to_fine_plan(const Parameters& parameters) {
  const int levels = level_count(parameters);
  RunPlan plan = {{"partition", 17}, {"sort", 13}};
  double nodes = 1;
  for (int level = 1; level < levels; ++level) nodes /= 4;
  for (int level = 0; level < levels; ++level, nodes *= 4) {
    const bool first = level == 0, last = level == levels - 1;
    const int rounds = rounds_of(parameters, level);
    for (int round = 0; round < rounds; ++round)
      add_round(plan, {round, first, last, round == rounds - 1}, nodes, parameters.span_width_m > 0);
  }
  const RunPlan rest = {{"misfit", 0}, {"spread", 7},      {"finish", 5},      {"above", 38},
                        {"sheets", 5}, {"link sheets", 9}, {"join sheets", 6}, {"upper", 2},
                        {"layers", 2}, {"layers", 4},      {"layers", 1},      {"commit", 47}};
  plan.insert(plan.end(), rest.begin(), rest.end());
  return plan;
}

}  // namespace

RunPlan build_plan(const Parameters& parameters) {
  if (parameters.method == Method::kCoarseToFine) return coarse_to_fine_plan(parameters);
  return {{"partition", 11}, {"model", 1},  {"model", 28}, {"link", 9},   {"merge", 2},  {"complete", 40},
          {"fit", 4},        {"layers", 1}, {"layers", 5}, {"layers", 1}, {"commit", 21}};
}

}  // namespace btms
