// Trial: an update of a large map equals its rebuild and works on few of its tiles.
//
// Beside a synthetic city lies a valley, and over it a bridge deck that ends in mid air: a further surface that nothing
// reaches. The first update digs a hole into the city. The second brings both ends of the bridge, so that the verdict
// on all of it is another one, in tiles far from the new points too. Each is compared with a build of the same points
// from nothing.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "engine/error.h"
#include "io/points/las_writer.h"
#include "io/store/map_store.h"
#include "tests/cli/program.h"

namespace btms::test {
namespace {

constexpr std::int64_t kHigh_mm = 6000;  // of the deck, and of the valley

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
    Ground ground(city_ + "/valley.las");
    const auto piece = [&](int x0_m, int y0_m, int x1_m, int y1_m, std::int64_t z0_mm, std::int64_t z1_mm) {
      ground.plane(x_ + x0_m * 1000, y_ + y0_m * 1000, x_ + x1_m * 1000, y_ + y1_m * 1000, z0_mm, z1_mm);
    };
    // Two plateaus; a road down into the valley and up again, and beside it the cutting that the bridge spans.
    piece(0, 0, 300, 300, kHigh_mm, kHigh_mm);
    piece(300, 120, 309, 180, kHigh_mm, 0);
    piece(300, 180, 360, 300, kHigh_mm, 0);
    piece(309, 120, 1491, 180, 0, 0);
    piece(360, 180, 1440, 300, 0, 0);
    piece(1491, 120, 1500, 180, 0, kHigh_mm);
    piece(1440, 180, 1500, 300, 0, kHigh_mm);
    piece(1500, 0, 1800, 300, kHigh_mm, kHigh_mm);
    deck(ground, 370, 1430);
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
      Ground ends(folder_ / "ends.las");
      deck(ends, 299, 370);
      deck(ends, 1430, 1501);
      ends.commit();
    }
    const bool hole = update("a hole in the city", "hole.las"), ends = update("both ends of the bridge", "ends.las");
    return hole && ends;
  }

 private:
  // A part of the bridge, 12 m wide.
  void deck(Ground& file, std::int64_t from_m, std::int64_t to_m) const {
    file.plane(x_ + from_m * 1000, y_ + 144'000, x_ + to_m * 1000, y_ + 156'000, kHigh_mm, kHigh_mm);
  }

  nlohmann::json call(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const Outcome outcome = test::run(arguments);
    if (outcome.status != 0) throw Error(ErrorCode::kFailed, arguments[0] + " failed: " + outcome.err);
    return outcome.json();
  }

  // Nodes of further surfaces that can be reached.
  std::uint64_t reachable() const {
    std::uint64_t nodes = 0;
    const auto map = MapReader::open(map_);
    for (const TileId id : map->tiles())
      for (const UpperNode& u : map->load(id)->upper) nodes += u.kind == UpperKind::kReachable;
    return nodes;
  }

  bool update(const char* what, const std::string& file) {
    const std::uint64_t reachable_before = reachable();
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
    std::printf("    %llu nodes of bridges could be reached, now %llu\n",
                static_cast<unsigned long long>(reachable_before), static_cast<unsigned long long>(reachable()));
    std::fflush(stdout);
    reached_ += reachable() > reachable_before;
    few_ = few_ && worked_on <= reach && 2 * worked_on < tiles;
    return same && worked_on <= reach;
  }

  TempFolder folder_;
  std::string city_, map_;
  std::vector<std::string> added_;
  std::int64_t x_ = 0, y_ = 0;  // south-west corner of the valley

 public:
  bool few_ = true;
  int reached_ = 0;  // updates that have made a bridge reachable
};

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app(
      "Updates of a map: a hole, and the ends of a bridge that turn the verdict on all of it; each compared with a "
      "rebuild");
  std::string points = "100000000";
  bool small = false;
  app.add_option("points", points, "Points of the city");
  app.add_flag("--small", small, "The map is too small for an update to leave half of it alone");
  CLI11_PARSE(app, argc, argv);
  try {
    btms::test::Trial trial(points);
    const bool good = trial.run() && trial.reached_ == 1 && (small || trial.few_);
    std::printf("updates: %s\n", good ? "equal to their rebuilds, within reach, less than half the map" : "FAILED");
    return good ? 0 : 1;
  } catch (const std::exception& e) {
    std::printf("updates: FAILED, %s\n", e.what());
    return 1;
  }
}
