// Scores of a terrain surface against the true one, sampled at places.
//
// Error is vertical, surface minus truth. Where the truth itself jumps (a wall, the edge of a cliff) half a metre
// sideways is worth any height, so a vertical error there says little: such places are to be scored apart, as
// `SurfaceSample::at_step`, and are part of no other group.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/terrain_tile.h"

namespace btms {

// One place. Lengths in micrometres, so that sums are exact in any order.
struct SurfaceSample {
  std::int32_t error_um = 0;  // saturates at 2 km; 0 where there is no surface
  std::uint8_t group = 0;     // the caller's: a stratum
  NodeState state = NodeState::kUnknown;
  bool within = false;   // |error| <= 1.96 sd
  bool at_step = false;  // the truth jumps here
};

// `z_m` and `sd_m` count only where there is a surface.
SurfaceSample surface_sample(NodeState state, double z_m, double sd_m, double truth_m, std::uint8_t group,
                             bool at_step);

// All figures 0 where there is nothing to count.
struct SurfaceScores {
  std::uint64_t places = 0;
  std::uint64_t known = 0;   // with a surface
  std::uint64_t filled = 0;  // of these a mere guess: NodeState::kFilled
  // Of the known places, metres:
  double rmse_m = 0, mae_m = 0, bias_m = 0;
  double p95_m = 0;   // 95 % of |error| are at most this: the element of rank ceil(0.95 n)
  double within = 0;  // share with |error| <= 1.96 sd

  double complete() const { return places == 0 ? 0 : static_cast<double>(known) / static_cast<double>(places); }
  double inferred() const {  // with a surface that is more than a guess
    return places == 0 ? 0 : static_cast<double>(known - filled) / static_cast<double>(places);
  }
};

// The result does not depend on the order of the samples.
SurfaceScores score_surface(std::vector<SurfaceSample> samples);

// Of the samples that `holds` accepts.
template <typename Holds>
SurfaceScores score_surface(std::span<const SurfaceSample> samples, Holds holds) {
  std::vector<SurfaceSample> some;
  for (const SurfaceSample& s : samples)
    if (holds(s)) some.push_back(s);
  return score_surface(std::move(some));
}

}  // namespace btms
