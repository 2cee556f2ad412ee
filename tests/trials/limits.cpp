// Trial: too little memory, disk, file size or open files is a message and exit status 1.
//
// Commands run with less and less of each, from too little for anything to enough, and with single allocations that
// fail. No signal, no false success, no temporary file.
#include <sys/mount.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <random>

#include "engine/error.h"
#include "tests/trials/disturbed.h"

namespace btms::test {
namespace {

struct Scene {
  std::string name;
  std::vector<std::string> arguments;
  bool over_old = false;
  Files wanted = {};
};

// A file system of its own, where the process may mount one.
class SmallDisk {
 public:
  SmallDisk(const fs::path& folder, std::uint64_t kib) : folder_(folder) {
    const std::string size = "size=" + std::to_string(kib) + "k";
    mounted_ = ::mount("none", folder_.c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount(folder_.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }

 private:
  const fs::path folder_;
  bool mounted_;
};

class Trial {
 public:
  explicit Trial(unsigned seed) : run_(folder_.path() / "run"), random_(seed) {
    const auto need = [](const Outcome& outcome) {
      if (outcome.status != 0) throw Error(ErrorCode::kFailed, "the trial could not be set up: " + outcome.err);
    };
    const std::string city = folder_ / "city", map = folder_ / "map.btms", out = (run_ / "out").string();
    need(test::run({"synth", "--scene", "city", "--points", "40000", "-o", city}));
    need(test::run({"build", city, "-o", map, "--resolution", "4"}));
    scenes_ = {{"build", {"build", city, "-o", out}},
               {"rebuild by 2 ranks", {"build", city, "-o", out, "--executor", "ranks:2"}, true},
               {"label", {"label", map, city, "-o", out}},
               {"synth", {"synth", "--points", "40000", "-o", out}}};
    for (Scene& scene : scenes_) {
      const Disturbed calm = attempt(scene, {});
      if (calm.outcome.status != 0) throw Error(ErrorCode::kFailed, scene.name + ": " + calm.outcome.err);
      scene.wanted = results_in(run_);
    }
  }

  // `most` is enough for all.
  void steps(const std::string& what, const std::string& variable, std::uint64_t least, std::uint64_t most,
             const std::string& remedy, std::size_t steps) {
    for (const Scene& scene : scenes_) {
      std::size_t refused = 0;
      for (std::size_t i = 0; i < steps; ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(1, steps - 1));
        const std::uint64_t limit =
            least + static_cast<std::uint64_t>(static_cast<double>(most - least) * part * part * part);
        const Disturbed run = attempt(scene, {{variable, std::to_string(limit)}});
        refused += run.outcome.status != 0;
        judge(scene.name + ", " + what + " " + std::to_string(limit), run, scene, remedy);
      }
      std::printf("%-20s %zu steps of %s, %zu refused\n", scene.name.c_str(), steps, what.c_str(), refused);
      std::fflush(stdout);
    }
  }

  // One allocation fails.
  void allocations(std::size_t count) {
    for (const Scene& scene : scenes_) {
      const Disturbed calm = attempt(scene, {{"BTMS_FAULTS_ERROR", "ENOMEM"}});
      std::size_t refused = 0;
      for (std::size_t i = 0; i < count; ++i) {
        // Early and late ones alike: most are of one pass.
        const std::uint64_t k =
            i % 2 == 0 ? 1 + random_() % calm.calls : std::min<std::uint64_t>(calm.calls, 1 + i * 4);
        const Disturbed run = attempt(scene, {{"BTMS_FAULTS_ERROR", "ENOMEM"}, {"BTMS_FAULTS_AT", std::to_string(k)}});
        refused += run.outcome.status != 0;
        judge(scene.name + ", allocation " + std::to_string(k), run, scene, "memory");
      }
      std::printf("%-20s %zu of %llu allocations failed, %zu refused\n", scene.name.c_str(), count,
                  static_cast<unsigned long long>(calm.calls), refused);
      std::fflush(stdout);
    }
  }

  void small_disks() {
    for (const Scene& scene : scenes_)
      for (const std::uint64_t kib : {32, 64, 128, 256, 512, 1024, 4096}) {
        fs::create_directories(run_);
        const SmallDisk disk(run_, kib);
        if (!disk.mounted()) return void(std::printf("no file system may be mounted here\n"));
        before_ = prepare(scene);
        judge(scene.name + ", a disk of " + std::to_string(kib) + " KiB", run_disturbed(scene.arguments, {}), scene,
              "free some space");
      }
  }

  std::size_t runs = 0, failures = 0, bad = 0;

 private:
  Files prepare(const Scene& scene) const {
    for (const auto& entry : fs::directory_iterator(run_)) fs::remove_all(entry.path());
    std::error_code full;  // of a small disk: then there is half a map, which is another trial
    if (scene.over_old) fs::copy(folder_ / "map.btms", run_ / "out", fs::copy_options::recursive, full);
    if (full) fs::remove_all(run_ / "out");
    return results_in(run_);
  }

  Disturbed attempt(const Scene& scene, const Environment& variables) {
    fs::create_directories(run_);
    before_ = prepare(scene);
    return run_disturbed(scene.arguments, variables);
  }

  void judge(const std::string& what, const Disturbed& run, const Scene& scene, const std::string& remedy) {
    ++runs;
    failures += run.outcome.status != 0;
    const std::string wrong = wrong_end(run, run_, before_, scene.wanted, remedy);
    if (wrong.empty()) return;
    ++bad;
    std::printf("BAD %s: %s\n    exit %d, %s\n", what.c_str(), wrong.c_str(), run.outcome.status,
                run.outcome.err.c_str());
  }

  TempFolder folder_;
  const fs::path run_;
  std::mt19937 random_;
  std::vector<Scene> scenes_;
  Files before_;
};

int run_trial(std::size_t steps, std::size_t allocations, unsigned seed) {
  Trial trial(seed);
  trial.steps("bytes of memory", "BTMS_LIMIT_AS", 0, std::uint64_t{512} << 20, "memory", steps);
  trial.allocations(allocations);
  trial.steps("bytes a file", "BTMS_LIMIT_FSIZE", 8192, std::uint64_t{1} << 20, "ulimit -f", steps / 2);
  trial.steps("open files", "BTMS_LIMIT_NOFILE", 3, 40, "ulimit -n", steps / 2);
  trial.small_disks();
  std::printf("%zu runs with too little: %zu failures told, %zu bad\n", trial.runs, trial.failures, trial.bad);
  return trial.bad == 0 ? 0 : 1;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Too little memory, disk, file size or open files: a message and exit status 1");
  std::size_t steps = 40;
  std::size_t allocations = 0;
  unsigned seed = 1;
  app.add_option("steps", steps, "From too little for anything to enough");
  // The C++ library lists folders without letting std::bad_alloc out: there a single lost allocation ends the program.
  app.add_option("--allocations", allocations, "Let so many single allocations of each command fail, too");
  app.add_option("--seed", seed, "Other allocations that fail");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::test::run_trial(steps, allocations, seed);
  } catch (const std::exception& error) {
    std::printf("BAD %s\n", error.what());
    return 1;
  }
}
