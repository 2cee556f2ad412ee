// A world seen from above by an airborne scanner: one return per pulse, the last one that a real scanner would keep.
#pragma once

#include <memory>
#include <vector>

#include "engine/scenes/scene.h"
#include "engine/scenes/world.h"

namespace btms {

// Pulses aim at a jittered grid on the ground, row after row in alternating direction. The highest object at a place
// stops its share of the pulses, the others go on to the next one and at last to the ground. Where pulses are slanted
// (slanted.h) a wall, roof or cliff that is in the way stops them first.
class AirborneScene final : public Scene {
 public:
  // Throws Error(kUsage) where the options make no scene.
  AirborneScene(const SceneOptions& options, std::unique_ptr<World> world);

  double origin_x_m() const override { return static_cast<double>(origin_x_mm_) / 1000; }
  double origin_y_m() const override { return static_cast<double>(origin_y_mm_) / 1000; }
  double width_m() const override;
  double height_m() const override;
  double ground_z_m(double x_m, double y_m) const override;
  SceneClass cover(double x_m, double y_m) const override;
  using Scene::truth;
  void truth(std::span<const ScenePlace> places, std::span<PlaceTruth> truths) const override;
  double ground_deviation_m() const override { return survey_.deviation_m; }
  std::size_t blocks() const override;
  void generate(std::size_t block, std::vector<ScenePoint>& points) const override;

 private:
  std::unique_ptr<World> world_;
  Survey survey_;
  std::uint64_t seed_;
  double density_per_m2_;
  std::int64_t origin_x_mm_, origin_y_mm_;
  std::int64_t edge_mm_;  // the area is a square
  std::size_t blocks_per_row_;
};

}  // namespace btms
