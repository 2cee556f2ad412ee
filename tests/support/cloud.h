// Point clouds in memory for tests, and a small hard scene.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "engine/tiling/point_source.h"

namespace btms::test {

struct CloudPoint {
  std::int64_t x_mm, y_mm;
  std::int32_t z_mm;
};

// Uniform numbers that are the same with every library (splitmix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  // Uniform in [low, high].
  std::int64_t between(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(next() % static_cast<std::uint64_t>(high - low + 1));
  }

 private:
  std::uint64_t state_;
};

class CloudSource final : public PointSource {
 public:
  explicit CloudSource(std::vector<CloudPoint> points) : points_(std::move(points)) {}
  std::string name() const override { return "cloud"; }
  std::uint64_t size() const override { return points_.size(); }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    block.reset(count);
    for (std::size_t i = 0; i < count; ++i) {
      const CloudPoint& p = points_[static_cast<std::size_t>(first) + i];
      block.x_mm[i] = p.x_mm;
      block.y_mm[i] = p.y_mm;
      block.z_mm[i] = p.z_mm;
      block.not_finite += p.x_mm == PointBlock::kDroppedX;
    }
  }
  const std::vector<CloudPoint>& points() const { return points_; }

 private:
  std::vector<CloudPoint> points_;
};

// Hills with roofs, trees, holes, a cliff and stray points, 1 point per square decimetre or so: something for every
// pass to do at every border. Metres from (x0, y0).
inline std::vector<CloudPoint> hard_scene(std::int64_t x0_mm, std::int64_t y0_mm, std::int64_t size_mm, std::size_t n,
                                          std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<CloudPoint> points;
  // Parabolic bumps instead of sines: the same heights everywhere.
  const auto bump = [](std::int64_t v, std::int64_t period, std::int64_t height) {
    const std::int64_t u = v % period, h = u < period / 2 ? u : period - u;
    return 4 * height * h / period * (period - h) / period;
  };
  while (points.size() < n) {
    const std::int64_t x = random.between(0, size_mm - 1), y = random.between(0, size_mm - 1);
    std::int64_t z = bump(x, 41000, 3100) + bump(y, 29000, 1900) + x / 25;
    const std::int64_t bx = x / 17000, by = y / 17000, ix = x % 17000, iy = y % 17000;
    const std::int64_t kind = (bx * 7 + by * 13) % 5;
    if (kind == 0 && ix > 3000 && ix < 12500 && iy > 2500 && iy < 13700) z = 9000 + by * 300 + ix / 9;  // a roof
    if (kind == 1 && ix > 4000 && ix < 9000 && iy > 4000 && iy < 9500) continue;                        // a hole
    if (kind == 2 && random.between(0, 2) == 0) z += random.between(300, 7000);                         // bushes
    if (kind == 3 && ix > 8000) z -= 2500;                                                              // a cliff
    if (random.between(0, 2999) == 0) z += random.between(-9000, 20000);                                // noise
    points.push_back({x0_mm + x, y0_mm + y, static_cast<std::int32_t>(z + random.between(-25, 25))});
  }
  return points;
}

// 120 m x 120 m: a road 6 m deep in a cutting along y, a street that crosses it askew on a bridge, a building with a
// flat roof, and a wood. Heights of the bare ground, of the street and of the roof in millimetres, from the south-west
// corner.
struct BridgeScene {
  static constexpr std::int64_t kSize_mm = 120'000;

  static std::int32_t street_mm(std::int64_t x) { return static_cast<std::int32_t>(10'000 + x / 100); }
  static std::int32_t ground_mm(std::int64_t x) {
    const std::int64_t out = x < 60'000 ? 60'000 - x : x - 60'000;
    return static_cast<std::int32_t>(street_mm(x) - std::clamp<std::int64_t>((14'000 - out) * 2 / 3, 0, 6'000));
  }
  static bool on_deck(std::int64_t x, std::int64_t y) {
    const std::int64_t across = y - 60'000 - (x - 60'000) * 3 / 10;
    return x > 45'500 && x < 74'500 && across > -11'000 && across < 11'000;
  }
  static bool on_roof(std::int64_t x, std::int64_t y) { return x > 10'000 && x < 32'000 && y > 15'000 && y < 45'000; }
  static bool in_wood(std::int64_t x, std::int64_t y) { return x > 85'000 && y > 80'000; }
  static constexpr std::int32_t kRoof_mm = 18'000;

  // As a scanner sees it from above.
  static std::vector<CloudPoint> points(std::int64_t x0_mm, std::int64_t y0_mm, std::size_t n, std::uint64_t seed = 1) {
    Random random(seed);
    std::vector<CloudPoint> points;
    while (points.size() < n) {
      const std::int64_t x = random.between(0, kSize_mm - 1), y = random.between(0, kSize_mm - 1);
      std::int64_t z = on_deck(x, y) ? street_mm(x) : on_roof(x, y) ? kRoof_mm : ground_mm(x);
      if (in_wood(x, y) && random.between(0, 2) > 0) z += random.between(1'000, 9'000);
      points.push_back({x0_mm + x, y0_mm + y, static_cast<std::int32_t>(z + random.between(-25, 25))});
    }
    return points;
  }
};

}  // namespace btms::test
