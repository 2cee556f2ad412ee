// What a sensor was driven over is terrain: maps of the scans of a drive, with and without its trajectory.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/model/memory_map.h"
#include "engine/model/surface.h"
#include "engine/scenes/drive.h"
#include "engine/tiling/build.h"
#include "io/points/pose_text.h"
#include "io/points/trajectory.h"
#include "tests/io/points/files.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

// A parking deck on a plain, 24 m wide and sheer all around: it could as well be a roof.
class ParkingDeck final : public World {
 public:
  double ground_m(double x, double y) const override {
    return std::abs(x - 100) < 50 && std::abs(y - 100) < 12 ? 4 : 0;
  }
  void place(const Box& /*box*/, std::vector<Object>& /*objects*/) const override {}
};

class TrajectoryOfADrive : public testing::Test {
 protected:
  static DriveOptions options() {
    DriveOptions o;
    o.scans = 20;
    o.step_m = 2;
    o.azimuths = 256;
    return o;
  }

  // All scans in the map frame.
  CloudSource cloud() const {
    std::vector<std::vector<DrivePoint>> scans(drive_.poses().size());
    drive_.scan(0, scans.size(), scans);
    std::vector<CloudPoint> points;
    const auto mm = [](double m) { return std::llround(m * 1000); };
    for (std::size_t i = 0; i < scans.size(); ++i)
      for (const DrivePoint& p : scans[i]) {
        const auto [x, y, z] = drive_.poses()[i].to_map({p.x_m, p.y_m, p.z_m});
        points.push_back({mm(x), mm(y), static_cast<std::int32_t>(mm(z))});
      }
    return CloudSource(std::move(points));
  }

  // The share of the path with observed terrain below the wheels.
  double borne(const Parameters& parameters, const std::vector<TrajectoryPoint>& trajectory) const {
    const PointSource* sources[] = {&cloud_};
    BuildOptions build;
    build.parameters = parameters;
    build.trajectory = trajectory;
    MemoryMap map;
    Progress progress;
    build_map(
        sources, build, *serial_threads(), *single_rank(),
        [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); }, progress);
    double on = 0;
    for (const Pose& pose : drive_.poses()) {
      const auto [x, y, z] = pose.to_map({0, 0, -options().sensor_height_m});
      const SurfacePoint s = surface_at(map, x, y);
      on += s.state == NodeState::kObserved && std::abs(s.z_m - z) < 0.2 ? 1 : 0;
    }
    return on / static_cast<double>(drive_.poses().size());
  }

  // As `build --trajectory trajectory.txt` reads what `synth --drive` writes.
  std::vector<TrajectoryPoint> trajectory() const {
    const TemporaryFolder folder;
    return read_trajectory(folder.write("trajectory.txt", tum_poses(drive_.poses(), 0.1)));
  }

  const Drive drive_{std::make_unique<ParkingDeck>(), {30, 30, 170, 170}, 1, options()};
  const CloudSource cloud_ = cloud();
};

TEST_F(TrajectoryOfADrive, KeepsTheDeckCoarseToFine) {
  EXPECT_EQ(borne(preset("city"), {}), 0) << "taken for a roof";
  EXPECT_EQ(borne(preset("city"), trajectory()), 1);
}

TEST_F(TrajectoryOfADrive, KeepsTheDeckOfTheFixedMethod) {
  Parameters p = preset("paper-partial-map");
  p.keep_nodes = 6000;  // none of the roofs of a town
  EXPECT_EQ(borne(p, {}), 0);
  EXPECT_EQ(borne(p, trajectory()), 1);
}

}  // namespace
}  // namespace btms::test
