// The plan of the city: a street grid that is turned and gently bent, and the block between four streets.
#pragma once

#include <cstdint>

#include "engine/scenes/noise.h"
#include "engine/scenes/world.h"

namespace btms {

// One line of the street grid, in bent coordinates.
struct Street {
  double centre_m = 0;
  double half_m = 0;     // from the centre to the kerb
  bool cutting = false;  // a road in a cutting below the others, which cross it on bridges
};

enum class BlockKind : std::uint8_t { kCourtyard, kSlabs, kHouses, kHalls, kTower, kPark };

// The inside of a block, behind its pavements.
struct Plot {
  BlockKind kind = BlockKind::kPark;
  Frame frame{};  // from the centre
  double half_s_m = 0, half_t_m = 0;
  Street west{}, east{}, south{}, north{};
  std::uint64_t seed = 0;
};

inline constexpr double kKerb_m = 0.12;
inline constexpr double kPavement_m = 2.5;
inline constexpr double kCuttingHalf_m = 14, kCuttingBottom_m = 5, kCuttingDepth_m = 6;

class City final : public World {
 public:
  explicit City(std::uint64_t seed);
  double ground_m(double x_m, double y_m) const override;
  std::optional<double> street_m(double x_m, double y_m) const override;
  void place(const Box& box, std::vector<Object>& objects) const override;

 private:
  struct Bent {
    double u_m, v_m;
  };
  Bent bend(double x_m, double y_m) const;
  Frame frame_at(Bent b) const;  // the linear part of the bending there
  double relief_m(double x_m, double y_m) const;
  Street across(std::int64_t i) const;    // the street at u = centre
  Street along(std::int64_t j) const;     // the street at v = centre
  std::int64_t column(double u_m) const;  // of the last street at or before u
  std::int64_t row(double v_m) const;
  Plot plot(std::int64_t i, std::int64_t j) const;
  BlockKind kind(std::int64_t i, std::int64_t j) const;
  void bridge(std::int64_t i, std::int64_t j, Placer& placer) const;

  std::uint64_t seed_;
  Noise hill_, slope_, bend_u_, bend_v_;
};

// Adds what stands in a block and along its kerbs.
void fill_plot(const Plot& plot, Placer& placer);

}  // namespace btms
