// What a build will take, told from the headers and a sample of the points: for `btms build --dry-run`. Everything here
// is an estimate, meant to be within a quarter of what then happens; nothing that is stored depends on it.
#pragma once

#include <cstdint>
#include <span>

#include "engine/tiling/build.h"

namespace btms {

// What is known of the inputs. Counts are those of BuildSummary, but for `area_m2` (where points are).
struct PointSurvey {
  std::uint64_t points = 0, tiles = 0, nodes = 0;
  double area_m2 = 0;
  std::uint64_t nodes_with_points = 0;

  double density_per_m2() const { return static_cast<double>(points) / area_m2; }
  double points_per_node() const { return static_cast<double>(points) / static_cast<double>(nodes_with_points); }
};

// Reads some two million points at most, spread over the sources. Throws as build_map() does for sources without a
// point and for too many nodes, and whatever a source throws.
PointSurvey survey_points(std::span<const PointSource* const> sources, const BuildOptions& options);

// A small build, to learn what a point and a node cost on this machine and in this terrain.
struct Trial {
  BuildSummary summary;
  double cpu_s = 0;  // of one thread
};
// Builds a part of the points in memory, in the calling thread; tiles go to `sink`.
Trial try_build(std::span<const PointSource* const> sources, const PointSurvey& survey, const BuildOptions& options,
                const SinkFactory& sink);

struct Forecast {
  double seconds = 0;
  std::uint64_t memory_bytes = 0;  // peak of the process
  std::uint64_t map_bytes = 0;     // on disk
  std::uint64_t spill_bytes = 0;   // written to the spill folder, in all
};

// `trial_map_bytes` is what the trial's tiles take when they are stored.
Forecast forecast_build(const PointSurvey& survey, const Trial& trial, std::uint64_t trial_map_bytes,
                        const BuildOptions& options, int threads);

}  // namespace btms
