// Trial: an update of a large map equals its rebuild and works on few of its tiles.
//
// Beside a synthetic city lies a terrace with walls all round, 1 km long: what stands on walls is no terrain. The first
// update digs a hole into the city. The second brings a ramp that joins the terrace to the ground, so that the verdict
// on all of it is another one. Each is compared with a build of the same points from nothing.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "engine/error.h"
#include "io/points/las_writer.h"
#include "tests/cli/program.h"

namespace btms::test {
namespace {

constexpr std::int64_t kLength_m = 1000, kHigh_mm = 6000;  // of the terrace

// Points of flat pieces of ground, 10 a square metre.
class Ground {
 public:
  explicit Ground(const fs::path& file) : file_(LasWriter::create(file, "EPSG:25832")) {}
  // From (x0, y0) to (x1, y1), rising from z0 to z1 along x.
  void plane(std::int64_t x0_mm, std::int64_t y0_mm, std::int64_t x1_mm, std::int64_t y1_mm, std::int64_t z0_mm,
             std::int64_t z1_mm) {
    constexpr std::int64_t kStep_mm = 316;
    std::vector<LasPoint> row;
    for (std::int64_t y = y0_mm; y < y1_mm; y += kStep_mm) {
      row.clear();
      for (std::int64_t x = x0_mm; x < x1_mm; x += kStep_mm)
        row.push_back({x, y, static_cast<std::int32_t>(z0_mm + (z1_mm - z0_mm) * (x - x0_mm) / (x1_mm - x0_mm)), 2, 0});
      file_->append(row);
    }
  }
  void commit() { file_->commit(); }

 private:
  std::unique_ptr<LasWriter> file_;
};

class Trial {
 public:
  explicit Trial(const std::string& points) : city_(folder_ / "points"), map_(folder_ / "map.btms") {
    call({"synth", "--scene", "city", "--points", points, "--crs", "EPSG:25832", "-o", city_});
    double east = 0;
    for (const std::string& name : names_in(city_)) {
      if (fs::path(name).extension() != ".las") continue;
      const auto info = run_json({"info", city_ + "/" + name});
      east = std::max(east, info["declared_bounds_m"][3].get<double>());
    }
    x_ = static_cast<std::int64_t>(east) * 1000 + 20'000;
    // Ground around a terrace that is 40 m wide.
    Ground ground(city_ + "/terrace.las");
    ground.plane(x_, y_, x_ + 120'000, y_ + 60'000, 0, 0);
    ground.plane(x_, y_ + 60'000, x_ + 40'000, y_ + 60'000 + kLength_m * 1000, 0, 0);
    ground.plane(x_ + 40'000, y_ + 60'000, x_ + 80'000, y_ + 60'000 + kLength_m * 1000, kHigh_mm, kHigh_mm);
    ground.plane(x_ + 80'000, y_ + 60'000, x_ + 120'000, y_ + 60'000 + kLength_m * 1000, 0, 0);
    ground.plane(x_, y_ + 60'000 + kLength_m * 1000, x_ + 120'000, y_ + 120'000 + kLength_m * 1000, 0, 0);
    ground.commit();
  }

  bool run() {
    call({"build", city_, "-o", map_, "--updatable"});
    {
      Ground hole(folder_ / "hole.las");
      hole.plane(120'000, 120'000, 132'000, 126'000, -3000, -3000);
      hole.commit();
    }
    {
      Ground ramp(folder_ / "ramp.las");  // 12 m wide, at its south end
      ramp.plane(x_ + 80'000, y_ + 100'000, x_ + 118'000, y_ + 112'000, kHigh_mm, 0);
      ramp.commit();
    }
    const bool hole = update("a hole in the city", "hole.las"), ramp = update("a ramp to the terrace", "ramp.las");
    return hole && ramp;
  }

 private:
  nlohmann::json call(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const Outcome outcome = test::run(arguments);
    if (outcome.status != 0) throw Error(ErrorCode::kFailed, arguments[0] + " failed: " + outcome.err);
    return outcome.json();
  }

  bool update(const char* what, const std::string& file) {
    const nlohmann::json updated = call({"build", folder_ / file, "-o", map_, "--update"});
    added_.push_back(folder_ / file);
    std::vector<std::string> all{"build", city_, "-o", folder_ / "new.btms"};
    all.insert(all.end(), added_.begin(), added_.end());
    const nlohmann::json rebuilt = call(all);
    fs::remove_all(folder_ / "new.btms");
    const std::uint64_t tiles = updated["tiles"], worked_on = updated["update"]["tiles_worked_on"],
                        reach = updated["update"]["tiles_in_reach"], renewed = updated["update"]["tiles_renewed"];
    const bool same = updated["digest"] == rebuilt["digest"];
    std::printf(
        "%s: %s the rebuild; %llu of %llu tiles worked on (the halos of all rounds reach %llu), %llu renewed; "
        "%.1f s, rebuilt in %.1f s\n",
        what, same ? "equal to" : "NOT EQUAL TO", static_cast<unsigned long long>(worked_on),
        static_cast<unsigned long long>(tiles), static_cast<unsigned long long>(reach),
        static_cast<unsigned long long>(renewed), updated["seconds"].get<double>(), rebuilt["seconds"].get<double>());
    std::fflush(stdout);
    few_ = few_ && worked_on <= reach && 2 * worked_on < tiles;
    return same && worked_on <= reach;
  }

  TempFolder folder_;
  std::string city_, map_;
  std::vector<std::string> added_;
  std::int64_t x_ = 0, y_ = 0;  // south-west corner of the ground around the terrace

 public:
  bool few_ = true;
};

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app(
      "Updates of a map: a hole, and a ramp that turns the verdict on a terrace; each compared with a rebuild");
  std::string points = "100000000";
  bool small = false;
  app.add_option("points", points, "Points of the city");
  app.add_flag("--small", small, "The map is too small for an update to leave half of it alone");
  CLI11_PARSE(app, argc, argv);
  try {
    btms::test::Trial trial(points);
    const bool good = trial.run() && (small || trial.few_);
    std::printf("updates: %s\n", good ? "equal to their rebuilds, within reach, less than half the map" : "FAILED");
    return good ? 0 : 1;
  } catch (const std::exception& e) {
    std::printf("updates: FAILED, %s\n", e.what());
    return 1;
  }
}
