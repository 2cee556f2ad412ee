// Trial: a build or a labelling that is killed anywhere loses nothing that it has committed, and its result, once it is
// run again, is that of an undisturbed one.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <set>

#include "io/files/read_file.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "tests/trials/killed.h"

namespace btms::test {
namespace {

class Trial {
 public:
  Trial(const std::string& points, std::uint64_t seed)
      : random_(seed), city_(folder_ / "city"), map_(folder_ / "map.btms") {
    succeed({"synth", "--scene", "city", "--points", points, "-o", city_});
    const auto begun = std::chrono::steady_clock::now();
    succeed({"build", city_, "-o", folder_ / "whole.btms", "--checkpoint-every", "0"});
    build_s_ = seconds_since(begun);
    whole_ = *read_manifest_of(folder_ / "whole.btms");
    const auto labelled = std::chrono::steady_clock::now();
    succeed({"label", folder_ / "whole.btms", city_, "-o", folder_ / "labels"});
    label_s_ = seconds_since(labelled);
  }

  void kill_build(int i) {
    std::vector<std::string> call{"build", city_, "-o", map_, "--checkpoint-every", "0", "--progress", "json"};
    if (i % 3 == 1) call.insert(call.end(), {"--executor", "ranks:2"});
    if (i % 3 == 2) call.emplace_back("--updatable");
    Running build(call);
    // Every fourth as soon as something is committed.
    if (i % 4 == 2) wait_for_commit(build);
    const std::string phase = kill_after(build, i % 4 == 2 ? 0 : within(build_s_));
    if (phase.empty()) build_s_ *= 0.9;  // the first one, on a cold cache, took longer
    ++kills_;
    if (!phase.empty()) ++hits_, ++phases_[phase];
    const std::set<TileId> committed = check_committed();
    call.insert(call.end(), {"--resume", "--json"});
    if (i % 2 == 1) kill_again(call, committed);
    const Outcome resumed = run_when_unlocked(call);
    const bool same = resumed.status == 0 && published_digest() == whole_.info.digest.hex();
    if (!same) std::printf("kill %d in %s: %s\n", i, phase.c_str(), resumed.err.c_str());
    equal_ += same;
    fs::remove_all(map_);
  }

  void kill_label(int i) {
    const std::string out = folder_ / "again";
    Running label({"label", folder_ / "whole.btms", city_, "-o", out, "--progress", "json"});
    const std::string phase = kill_after(label, within(label_s_));
    ++kills_;
    if (!phase.empty()) ++hits_, ++phases_["label"];
    bool same = true;
    if (fs::exists(out))  // what is there is whole
      for (const std::string& name : names_in(out))
        same = same && equal_files(folder_ / ("labels/" + name), out + "/" + name);
    const Outcome again = run({"label", folder_ / "whole.btms", city_, "-o", out, "--force"});
    same = same && again.status == 0 && names_in(out) == names_in(folder_ / "labels");
    for (const std::string& name : names_in(out))
      same = same && equal_files(folder_ / ("labels/" + name), out + "/" + name);
    if (!same) std::printf("kill %d of label: %s\n", i, again.err.c_str());
    equal_ += same;
    fs::remove_all(out);
  }

  bool report() const {
    const bool good = equal_ == kills_ && lost_ == 0 && (kills_ < 20 || hits_ * 5 >= kills_ * 4);
    std::printf("phases: %s\n", counted_phases(phases_).c_str());
    std::printf(
        "kills: %d, %d of a running program, %d equal results, %d committed shards looked at, %d lost or wrong: %s\n",
        kills_, hits_, equal_, committed_, lost_, good ? "ok" : "FAILED");
    return good;
  }

 private:
  // What a build that is taken up has committed stays so when it is killed too.
  void kill_again(const std::vector<std::string>& call, const std::set<TileId>& committed) {
    Running build(call);
    kill_after(build, within(build_s_));
    if (read_manifest_of(map_)) return;
    const std::set<TileId> now = check_committed();
    for (const TileId id : committed) lost_ += !now.contains(id);
  }

  void wait_for_commit(Running& build) const {
    const auto journaled = [&] {
      const auto interrupted = read_journals(map_);
      return interrupted && !interrupted->entries.empty();
    };
    while (!build.has_ended() && !journaled()) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }

  double within(double seconds) { return seconds * static_cast<double>(random_.between(0, 950)) / 1000; }

  std::string published_digest() const {
    const auto manifest = read_manifest_of(map_);
    return manifest ? manifest->info.digest.hex() : "none";
  }

  static bool equal_files(const fs::path& a, const fs::path& b) {
    return fs::exists(a) && read_text(a) == read_text(b);
  }

  // Every shard in the journal is there, whole, and what an undisturbed build makes. Returns them.
  std::set<TileId> check_committed() {
    std::set<TileId> ids;
    const auto interrupted = read_journals(map_);
    if (!interrupted) return ids;
    for (const ShardEntry& s : journaled_shards(*interrupted, whole_.info.layout)) {
      ++committed_;
      ids.insert(s.id);
      const auto same = std::find_if(whole_.shards.begin(), whole_.shards.end(),
                                     [&](const ShardEntry& w) { return w.id == s.id && w.digest == s.digest; });
      try {
        if (xxh3_64(read_shard(map_, s)) == s.file_xxh3 && same != whole_.shards.end()) continue;
      } catch (const Error&) {
      }
      ++lost_;
    }
    return ids;
  }

  TempFolder folder_;
  Random random_;
  std::string city_, map_;
  Manifest whole_;
  double build_s_ = 0, label_s_ = 0;
  int kills_ = 0, hits_ = 0, equal_ = 0, committed_ = 0, lost_ = 0;
  std::map<std::string, int> phases_;
};

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Kills builds (threads, ranks, updatable) and labellings at random moments and runs them again");
  int count = 200;
  std::uint64_t seed = 1;
  std::string points = "1500000";
  app.add_option("count", count, "Kills");
  app.add_option("--points", points, "Points of the city");
  app.add_option("--seed", seed, "Of the moments");
  CLI11_PARSE(app, argc, argv);
  try {
    btms::test::Trial trial(points, seed);
    for (int i = 0; i < count; ++i)
      if (i % 8 == 7)
        trial.kill_label(i);
      else
        trial.kill_build(i);
    return trial.report() ? 0 : 1;
  } catch (const std::exception& e) {
    std::printf("kills: FAILED, %s\n", e.what());
    return 1;
  }
}
