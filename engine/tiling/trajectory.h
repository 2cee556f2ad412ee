// Where the sensor has been. What lies right below it is terrain, whatever its rim looks like: the component it passed
// over is kept.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/tiling/tile_table.h"

namespace btms {

// Map frame.
struct TrajectoryPoint {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
};

// A sensor is carried or driven at most this high above what bears it, and noise may put it a little below.
inline constexpr std::int32_t kSensorHighest_mm = 3500, kSensorLowest_mm = -200;

struct Passage {
  NodeId node;
  std::int32_t dx_mm, dy_mm;  // from the centre of the node's square
  std::int32_t z_mm;

  // Whether a surface with this height here bore the sensor.
  bool borne_by(double surface_mm) const {
    return z_mm - surface_mm >= kSensorLowest_mm && z_mm - surface_mm <= kSensorHighest_mm;
  }
};

// The nodes below the trajectory, by tile.
class PassagesByTile {
 public:
  PassagesByTile(const std::vector<TrajectoryPoint>& trajectory, const TileTable& table);
  std::span<const Passage> of(std::size_t tile) const { return by_tile_[tile]; }

 private:
  std::vector<std::vector<Passage>> by_tile_;
};

}  // namespace btms
