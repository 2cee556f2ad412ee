// How far a level's surface can be trusted, and how far above it points are terrain. Numbers: docs/accuracy.md.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/terrain/level_fit.h"

namespace btms {

// Points up to this far above the surface, vertically, are terrain. `disagreement_mm`: how far the planes around the
// place are apart; `ground_mm`: scatter of the ground's own points around it.
inline double terrain_height_mm(const PriorPlane& surface, double disagreement_mm, double ground_mm,
                                const LevelParameters& p) {
  const double slope = std::min(surface.slope(), p.label_slope_cap);
  // A good survey of a smooth street is no reason to take a kerb for an obstacle.
  return p.label_spread * std::max(p.label_least_m * 1000, ground_mm) +
         (p.label_disagreement + p.label_slope * slope) * disagreement_mm + p.label_uncertainty * surface.sd_mm;
}

// Standard deviation of a height where the terrain was seen: the disagreement of the planes. Where the ground is so
// smooth that only the survey's noise keeps them apart, averaging them removes part of it.
inline double observed_sd_mm(double disagreement_mm, double ground_mm, const LevelParameters& p) {
  const double rough = std::min(1.0, ground_mm / (p.sd_smooth_m * 1000));
  return std::max(p.sd_observed * disagreement_mm * rough, p.sd_least * ground_mm);
}

// Where it was not: the spread of what it was inferred from, and what `coarser_mm2` says finer levels would have
// changed.
inline double inferred_sd_mm(const PriorPlane& surface, double coarser_mm2, double ground_mm,
                             const LevelParameters& p) {
  const double spread_mm = p.sd_inferred * surface.sd_mm;
  return std::max(std::sqrt(spread_mm * spread_mm + coarser_mm2), p.sd_least * ground_mm);
}

}  // namespace btms
