// Trial: a reader of a map sees nothing of an update that is killed beside it, and the update, taken up, is that of an
// undisturbed one.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>

#include "io/store/map_folder.h"
#include "tests/trials/killed.h"

namespace btms::test {
namespace {

// Loads all tiles of the revision it has opened, again and again.
class Reader {
 public:
  explicit Reader(const fs::path& map) : reader_(MapReader::open(map)), thread_([this] { read(); }) {}
  ~Reader() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t tiles() const { return tiles_; }
  std::uint64_t changed() const { return changed_; }

 private:
  void read() {
    do {
      Digest sum;
      for (const TileId id : reader_->tiles()) try {
          sum += digest(*reader_->load(id));
          ++tiles_;
        } catch (const Error& e) {
          std::printf("%s\n", e.what());
          ++changed_;
        }
      if (sum != reader_->info().digest) ++changed_;
    } while (!stop_);
  }
  std::unique_ptr<MapReader> reader_;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> tiles_ = 0, changed_ = 0;
  std::thread thread_;
};

int trial(int count, const std::string& points, std::uint64_t seed) {
  TempFolder folder;
  Random random(seed);
  const std::string city = folder / "city", more = folder / "more", old = folder / "old.btms",
                    map = folder / "map.btms";
  succeed({"synth", "--scene", "city", "--points", points, "-o", city});
  succeed({"synth", "--scene", "hills", "--points", "20000", "-o", more});
  succeed({"build", city, "-o", old, "--updatable"});
  const auto restore = [&] {
    fs::remove_all(map);
    fs::copy(old, map, fs::copy_options::recursive);
  };
  std::vector<std::string> call{"build", more, "-o", map, "--update", "--progress", "json"};
  restore();
  const auto begun = std::chrono::steady_clock::now();
  succeed(call);
  double update_s = seconds_since(begun);
  const std::string updated = read_manifest_of(map)->info.digest.hex(),
                    before = read_manifest_of(old)->info.digest.hex();
  restore();

  int hits = 0, wrong = 0, taken_up = 0;
  std::uint64_t tiles = 0, changed = 0;
  std::map<std::string, int> phases;
  for (int i = 0; i < count; ++i) {
    std::vector<std::string> now = call;
    if (i % 2 == 1) now.insert(now.end(), {"--executor", "ranks:2"});
    Reader reader(map);
    Running update(now);
    const std::string phase = kill_after(update, update_s * static_cast<double>(random.between(0, 950)) / 1000);
    if (!phase.empty()) ++hits, ++phases[phase];
    if (phase.empty()) update_s *= 0.9;
    const auto manifest = read_manifest_of(map);
    const std::string is = manifest ? manifest->info.digest.hex() : "none";
    if (is != before && is != updated) ++wrong;
    if (i % 5 == 4 && is == before) {  // gone on with
      now.emplace_back("--resume");
      const Outcome outcome = run_when_unlocked(now);
      ++taken_up;
      if (outcome.status != 0 || read_manifest_of(map)->info.digest.hex() != updated)
        ++wrong, std::printf("update %d in %s: %s\n", i, phase.c_str(), outcome.err.c_str());
    }
    reader.stop();
    tiles += reader.tiles();
    changed += reader.changed();
    if (read_manifest_of(map)->info.digest.hex() != before) restore();
  }
  const bool good = wrong == 0 && changed == 0 && (count < 20 || hits * 5 >= count * 4);
  std::printf("phases: %s\n", counted_phases(phases).c_str());
  std::printf(
      "updates: %d killed, %d while running, %d taken up; %llu tiles read beside them, %llu changed; %d wrong maps: "
      "%s\n",
      count, hits, taken_up, static_cast<unsigned long long>(tiles), static_cast<unsigned long long>(changed), wrong,
      good ? "ok" : "FAILED");
  return good ? 0 : 1;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Kills updates of a map at random moments, beside a reader of the revision before");
  int count = 200;
  std::uint64_t seed = 1;
  std::string points = "1500000";
  app.add_option("count", count, "Updates");
  app.add_option("--points", points, "Points of the city");
  app.add_option("--seed", seed, "Of the moments");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::test::trial(count, points, seed);
  } catch (const std::exception& e) {
    std::printf("updates: FAILED, %s\n", e.what());
    return 1;
  }
}
