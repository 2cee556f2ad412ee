// Smooth deterministic noise: values hashed at integer places, joined by a quintic (continuous first and second
// derivative). Only + - * and floor, so the bits are the same everywhere.
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/scenes/random.h"

namespace btms {

// 0 -> 0, 1 -> 1 with vanishing first and second derivative at both ends.
constexpr double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
constexpr double fade_slope(double t) { return 30 * t * t * (t - 1) * (t - 1); }
constexpr double clamp_unit(double t) { return t < 0 ? 0 : t > 1 ? 1 : t; }

// [-1, 1], one value every wavelength. Steepest slope: 3.75 / wavelength.
class Noise {
 public:
  Noise(std::uint64_t seed, double wavelength_m) : seed_(mix(seed + kGolden)), frequency_(1 / wavelength_m) {
    // Each layer is turned by its own angle, so that the lattices of a sum do not show.
    const double t = unit(mix(seed_)), n = 1 + t * t;
    c_ = (1 - t * t) / n * frequency_;
    s_ = 2 * t / n * frequency_;
  }

  double at(double x_m) const {
    const double p = x_m * frequency_, cell = std::floor(p), t = fade(p - cell);
    const auto i = static_cast<std::int64_t>(cell);
    const double a = value(i, 0), b = value(i + 1, 0);
    return a + (b - a) * t;
  }
  double slope(double x_m) const {
    const double p = x_m * frequency_, cell = std::floor(p);
    const auto i = static_cast<std::int64_t>(cell);
    return (value(i + 1, 0) - value(i, 0)) * fade_slope(p - cell) * frequency_;
  }
  double at(double x_m, double y_m) const {
    const double p = c_ * x_m + s_ * y_m, q = c_ * y_m - s_ * x_m;
    const double cell_p = std::floor(p), cell_q = std::floor(q), s = fade(p - cell_p), t = fade(q - cell_q);
    const auto i = static_cast<std::int64_t>(cell_p), j = static_cast<std::int64_t>(cell_q);
    const double a = value(i, j), b = value(i + 1, j), c = value(i, j + 1), d = value(i + 1, j + 1);
    return a + (b - a) * s + (c - a) * t + (a - b - c + d) * s * t;
  }

 private:
  double value(std::int64_t i, std::int64_t j) const {
    return signed_unit(mix(seed_ + static_cast<std::uint64_t>(i) * 0xd1342543de82ef95u +
                           static_cast<std::uint64_t>(j) * 0xaf251af3b0f025b5u));
  }

  std::uint64_t seed_;
  double frequency_;
  double c_, s_;  // the turn, times the frequency
};

}  // namespace btms
