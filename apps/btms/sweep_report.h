// What `btms sweep` found: one row a setting, as table, CSV and JSON.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/metrics/metrics.h"
#include "engine/terrain/parameters.h"

namespace btms {

// One value of one parameter, everything else as it was.
struct SweepRow {
  std::string parameter;  // name in the parameter table
  double value = 0;
  Completion completion = Completion::kKernel;
  std::vector<Scores> files;

  // Mean of the files.
  double accuracy(Confusion Scores::*part) const { return over_files(files, part, &Confusion::accuracy).mean; }
};

// Rows of one parameter follow each other.
struct Sweep {
  std::string preset;
  std::size_t files = 0;
  std::uint64_t dropped = 0;  // points of all files that are not finite or out of range
  bool ambiguous = false;     // the two parts of the scores differ
  std::vector<SweepRow> rows;

  std::vector<std::string> parameters() const;  // in the order of the rows
  // Greatest less least accuracy without the ambiguous classes; nothing for fewer than two values.
  std::optional<double> spread(const std::string& parameter, Completion completion) const;
};

void print_sweep_text(const Sweep& sweep);
void print_sweep_json(const Sweep& sweep, const std::filesystem::path& folder);
// Throws Error(kFailed).
void write_sweep_csv(const Sweep& sweep, const std::filesystem::path& csv);

}  // namespace btms
