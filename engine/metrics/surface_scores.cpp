#include "engine/metrics/surface_scores.h"

#include <algorithm>
#include <cmath>

namespace btms {

SurfaceSample surface_sample(NodeState state, double z_m, double sd_m, double truth_m, std::uint8_t group,
                             bool at_step) {
  SurfaceSample s{.group = group, .state = state, .at_step = at_step};
  if (state == NodeState::kUnknown) return s;
  const double error_m = z_m - truth_m;
  s.error_um = static_cast<std::int32_t>(std::floor(std::clamp(error_m, -2000.0, 2000.0) * 1e6 + 0.5));
  s.within = std::abs(error_m) <= 1.96 * sd_m;
  return s;
}

SurfaceScores score_surface(std::vector<SurfaceSample> samples) {
  SurfaceScores scores{.places = samples.size()};
  std::erase_if(samples, [](const SurfaceSample& s) { return s.state == NodeState::kUnknown; });
  scores.known = samples.size();
  if (samples.empty()) return scores;
  // Squares reach 2^62: their sum needs more than 64 bits.
  unsigned __int128 square = 0;
  std::int64_t sum = 0, absolute = 0, within = 0;
  for (const SurfaceSample& s : samples) {
    const std::int64_t e = s.error_um;
    square += static_cast<unsigned __int128>(e * e);
    sum += e;
    absolute += std::abs(e);
    within += s.within;
    scores.filled += s.state == NodeState::kFilled;
  }
  const auto n = static_cast<double>(samples.size());
  scores.rmse_m = std::sqrt(static_cast<double>(square) / n) / 1e6;
  scores.mae_m = static_cast<double>(absolute) / n / 1e6;
  scores.bias_m = static_cast<double>(sum) / n / 1e6;
  scores.within = static_cast<double>(within) / n;
  const std::size_t rank = (samples.size() * 95 + 99) / 100 - 1;
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(samples.begin(), at, samples.end(), [](const SurfaceSample& a, const SurfaceSample& b) {
    return std::abs(a.error_um) < std::abs(b.error_um);
  });
  scores.p95_m = std::abs(at->error_um) / 1e6;
  return scores;
}

}  // namespace btms
