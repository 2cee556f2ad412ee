// btms build --dry-run: what a build would take, without writing anything.
#pragma once

#include "apps/btms/inputs.h"
#include "engine/tiling/forecast.h"

namespace btms {

struct DryRun {
  PointSurvey survey;
  Forecast forecast;
  int threads = 1;
};

// Throws what survey_points() and try_build() throw.
DryRun dry_run(const PointFiles& files, const BuildOptions& options, int threads);

void print_dry_run(const DryRun& run, bool as_json);

}  // namespace btms
