// Truth and prediction, file by file, for `btms eval`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/metrics/metrics.h"

namespace btms {

struct EvalPair {
  std::string name;  // the stem both share
  std::filesystem::path truth, prediction;
  std::filesystem::path points;  // where coordinates come from; empty when they aren't needed
};

// Pairs two files, or files by their stems where one of the two is a folder; what has no partner is logged. `points`
// may be a file, a folder, or empty (the truth itself when it is a point file, else the folder `velodyne` beside the
// truth's). Throws Error(kUsage) when a path is missing, Error(kBadInput) when nothing pairs.
std::vector<EvalPair> pair_files(const std::filesystem::path& truth, const std::filesystem::path& prediction,
                                 const std::filesystem::path& points, bool needs_points);

// What became of the points of one true class.
struct ClassCount {
  std::uint64_t points = 0;
  std::uint64_t terrain = 0;  // called terrain
};

struct EvalResult {
  std::string name;
  std::uint64_t points = 0;    // with a prediction
  std::uint64_t left_out = 0;  // the prediction has none (dropped points)
  Scores scores;
  std::map<std::uint32_t, ClassCount> classes;
};

// Both throw Error(kBadInput) when the files can't be read or have different numbers of points. A verdict for every
// point of the truth; one without a prediction is left out.
std::vector<Verdict> verdicts(const EvalPair& pair, const TruthRules& rules);
EvalResult evaluate(const EvalPair& pair, const TruthRules& rules);

}  // namespace btms
