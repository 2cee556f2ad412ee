// The phases a build will go through and how its time divides between them, so that progress can be told of the run.
#pragma once

#include <string>
#include <vector>

#include "engine/terrain/parameters.h"

namespace btms {

struct PlannedPhase {
  std::string name;   // as Progress::begin() will be told
  double weight = 1;  // share of the time, in any unit
};
using RunPlan = std::vector<PlannedPhase>;

// Weights were measured on airborne points, ten to a node; where they are wrong the ETA corrects itself as phases end.
// Phases that a run adds or leaves out do no harm: the display looks a few steps ahead for a name.
RunPlan build_plan(const Parameters& parameters);

}  // namespace btms
