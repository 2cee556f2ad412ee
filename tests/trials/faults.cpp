// Trial: out of disk or handles, or a failing disk, is a message and an exit code.
//
// Every call that writes (or opens) of several commands fails in turn, once or from then on. The program must say so,
// in words that name a file and a remedy, leave no temporary file, and leave what was there or what was to be, whole;
// it may succeed only when the result is complete. Writes that are cut short or interrupted must change nothing.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <random>

#include "engine/error.h"
#include "tests/trials/disturbed.h"

namespace btms::test {
namespace {

struct Fault {
  std::string error;
  std::string remedy;  // its message must contain this; empty: there must be none
};
const std::vector<Fault> kFaults = {
    {"ENOSPC", "free some space"}, {"EIO", "check the disk"}, {"EMFILE", "ulimit -n"}, {"SHORT", ""}, {"EINTR", ""}};

constexpr std::uint64_t kMostCalls = 100;  // of a command: one that spills has 200 000, much alike

// A command that writes below `run`.
struct Scene {
  std::string name;
  std::vector<std::string> arguments;
  std::function<void(const fs::path& run)> prepare = [](const fs::path&) {};
};

class Trial {
 public:
  Trial() : run_(folder_.path() / "run") {
    const auto need = [](const Outcome& outcome) {
      if (outcome.status != 0) throw Error(ErrorCode::kFailed, "the trial could not be set up: " + outcome.err);
    };
    const std::string city = at("city"), drive = at("drive"), map = at("map.btms");
    need(test::run({"synth", "--scene", "city", "--points", "40000", "-o", city}));
    need(test::run(
        {"synth", "--scene", "city", "--drive", "--scans", "2", "--beams", "16", "--azimuths", "256", "-o", drive}));
    need(test::run({"build", city, "-o", map}));
    need(test::run({"build", city, "-o", at("other.btms"), "--resolution", "4"}));
    const std::string scans = at("drive/velodyne"), out = (run_ / "out").string();
    const std::vector<std::string> build = {"build", city, "-o", out};
    const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
      words.insert(words.end(), more.begin(), more.end());
      return words;
    };
    const auto over_old = [this](const fs::path& run) {
      fs::copy(folder_.path() / "other.btms", run / "out", fs::copy_options::recursive);
    };
    scenes_ = {
        {"build", build},
        {"rebuild", build, over_old},
        {"rebuild by 2 ranks", with(build, {"--executor", "ranks:2"}), over_old},
        {"build with a picture", with(build, {"--picture", (run_ / "map.png").string()})},
        {"build that spills",
         with(build,
              {"--memory", "128M", "--spill", (run_ / "spill").string(), "--resolution", "0.15", "--levels", "1"}),
         [](const fs::path& run) { fs::create_directory(run / "spill"); }},
        {"2 ranks that spill",
         with(build, {"--memory", "128M", "--spill", (run_ / "spill").string(), "--resolution", "0.15", "--levels", "1",
                      "--executor", "ranks:2"}),
         [](const fs::path& run) { fs::create_directory(run / "spill"); }},
        {"label", {"label", map, city, "-o", out}},
        {"segment", {"segment", scans, "-o", out}},
        {"synth", {"synth", "--points", "20000", "--density", "2", "--files", "2", "-o", out}},
        {"synth --drive",
         {"synth", "--drive", "--scans", "2", "--beams", "8", "--azimuths", "64", "--points", "20000", "-o", out}},
        {"accumulate",
         {"accumulate", "--scans", scans, "--labels", at("drive/labels"), "--poses", at("drive/poses.txt"), "-o",
          (run_ / "sum.las").string(), "--write-poses", (run_ / "poses.txt").string()}},
    };
  }

  struct Point {
    std::size_t scene, fault;
    std::uint64_t call;
    bool lasting;
  };

  // What every scene does undisturbed, and every way to disturb it.
  std::vector<Point> points() {
    std::vector<Point> all;
    for (std::size_t s = 0; s < scenes_.size(); ++s) {
      std::string counts;
      Disturbed calm;
      for (std::size_t f = 0; f < kFaults.size(); ++f) {
        // ENOSPC and EIO befall the same calls, so do SHORT and EINTR.
        if (f == 0 || kFaults[f].error == "EMFILE" || kFaults[f].error == "SHORT")
          calm = attempt(scenes_[s], {{"BTMS_FAULTS_ERROR", kFaults[f].error}});
        if (calm.outcome.status != 0) throw Error(ErrorCode::kFailed, scenes_[s].name + ": " + calm.outcome.err);
        if (f == 0) wanted_.push_back(results_in(run_));
        if (wanted_.back() != results_in(run_)) throw Error(ErrorCode::kFailed, scenes_[s].name + " is not repeatable");
        counts.append(" ").append(std::to_string(calm.calls)).append(" ").append(kFaults[f].error);
        const std::uint64_t stride = 1 + calm.calls / kMostCalls;
        for (std::uint64_t k = 1; k <= calm.calls; k += stride) {
          all.push_back({s, f, k, false});
          if (!kFaults[f].remedy.empty()) all.push_back({s, f, k, true});
        }
      }
      std::printf("%-22s%s\n", scenes_[s].name.c_str(), counts.c_str());
    }
    return all;
  }

  // What is wrong after one fault; "" when nothing is.
  std::string disturb(const Point& point) {
    const Scene& scene = scenes_[point.scene];
    const Fault& fault = kFaults[point.fault];
    const Disturbed run = attempt(scene, {{"BTMS_FAULTS_ERROR", fault.error},
                                          {"BTMS_FAULTS_AT", std::to_string(point.call)},
                                          {"BTMS_FAULTS_LASTING", point.lasting ? "1" : "0"}});
    injected_ += run.failed > 0;
    failed_ += run.outcome.status != 0;
    const std::string wrong = judge(run, fault, wanted_[point.scene]);
    if (wrong.empty()) return {};
    return scene.name + ", " + fault.error + " at call " + std::to_string(point.call) +
           (point.lasting ? " and on" : "") + ": " + wrong + "\n    exit " + std::to_string(run.outcome.status) + ", " +
           run.outcome.err;
  }

  // Nobody can read the result: that is a failure too.
  std::vector<std::string> full_stdout() {
    std::vector<std::string> wrong;
    for (const Scene& scene : scenes_)
      for (const bool json : {false, true}) {
        Scene told = scene;
        if (json) told.arguments.emplace_back("--json");
        const Disturbed run = attempt(told, {}, "/dev/full");
        ++injected_;
        failed_ += run.outcome.status != 0;
        if (run.outcome.status != 1 || run.outcome.err.find("stdout") == std::string::npos)
          wrong.push_back(scene.name + (json ? " --json" : "") + " to a full disk: exit " +
                          std::to_string(run.outcome.status) + ", " + run.outcome.err);
      }
    return wrong;
  }

  std::size_t injected() const { return injected_; }
  std::size_t failed() const { return failed_; }

 private:
  std::string at(const std::string& name) const { return folder_ / name; }

  Disturbed attempt(const Scene& scene, const Environment& variables, const std::string& out = {}) {
    fs::remove_all(run_);
    fs::create_directory(run_);
    scene.prepare(run_);
    before_ = results_in(run_);
    return run_disturbed(scene.arguments, variables, out);
  }

  std::string judge(const Disturbed& run, const Fault& fault, const Files& wanted) const {
    if (run.outcome.status == 1 && fault.remedy.empty()) return "failed although nothing was wrong";
    if (run.outcome.status == 1 && run.outcome.err.find(folder_.path().string()) == std::string::npos)
      return "the message names no file";
    return wrong_end(run, run_, before_, wanted, fault.remedy);
  }

  TempFolder folder_;
  const fs::path run_;
  std::vector<Scene> scenes_;
  std::vector<Files> wanted_;  // of every scene
  Files before_;
  std::size_t injected_ = 0, failed_ = 0;
};

int run_trial(std::size_t count, unsigned seed) {
  Trial trial;
  std::vector<Trial::Point> points = trial.points();
  std::mt19937 random(seed);
  std::shuffle(points.begin(), points.end(), random);
  std::printf("%zu ways to fail, %zu are tried\n", points.size(), std::min(count, points.size()));
  std::vector<std::string> wrong = trial.full_stdout();
  for (const std::string& what : wrong) std::printf("BAD %s\n", what.c_str());
  for (std::size_t i = 0; i < std::min(count, points.size()); ++i) {
    if (const std::string what = trial.disturb(points[i]); !what.empty()) {
      wrong.push_back(what);
      std::printf("BAD %s\n", what.c_str());
    }
    if (i % 100 == 99) std::printf("%zu tried\n", i + 1), std::fflush(stdout);
  }
  std::printf("%zu errors injected: %zu failures told, %zu bad\n", trial.injected(), trial.failed(), wrong.size());
  return wrong.empty() ? 0 : 1;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Injects errors into calls that write: no signal, no false success, no temporary file");
  std::size_t count = 500;
  unsigned seed = 1;
  app.add_option("count", count, "So many of all the ways to fail, at random");
  app.add_option("--seed", seed, "Others");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::test::run_trial(count, seed);
  } catch (const std::exception& error) {
    std::printf("BAD %s\n", error.what());
    return 1;
  }
}
