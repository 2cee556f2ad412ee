// What `btms build` says when it is done.
#pragma once

#include <optional>
#include <string>

#include "apps/btms/parameter_options.h"
#include "apps/btms/report.h"
#include "engine/tiling/build.h"
#include "io/store/map_store.h"

namespace btms {

struct BuildReport {
  BuildSummary summary;
  ParameterChoice choice;
  std::string map, picture, executor;
  Json inputs = Json::array();
  std::optional<TrajectoryRecord> trajectory;
  std::vector<std::string> warnings;  // of the whole; a file's own are in `inputs`
  bool updated = false;               // followed the map that was there
  double seconds = 0;                 // from the first point read to the map published
};

// Null without one.
Json trajectory_json(const std::optional<TrajectoryRecord>& trajectory);
std::string trajectory_text(const TrajectoryRecord& trajectory);

void print_build_report(const BuildReport& report, bool as_json);

}  // namespace btms
