// Trial: the old result or the new one, whole, wherever a crash or a power cut falls.
//
// Runs commands with every write logged, then makes the folder as it would be after each of the writes, in two ways:
//   crash  all writes up to there have happened, half of the last one
//   power  what was written and not followed by an fsync of that file is there with p = 0.5, now and then half of it;
//          names likewise, unless the folder was fsynced
// What is found there must be what was there before or, from its commit on, what the command makes. A power cut after
// the command's end loses nothing.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <random>
#include <set>

#include "engine/error.h"
#include "tests/trials/disturbed.h"
#include "tests/trials/write_log.h"

namespace btms::test {
namespace {

// A logged call. Files are numbered as they come to be: an inode may be used again.
struct Step {
  WriteOp op;
  std::size_t file = 0;
  std::uint64_t offset = 0;
  std::string path, other, data;  // paths without the folder all is in, folders without a slash at the end
};

std::string parent_of(const std::string& path) { return fs::path(path).parent_path().string(); }

struct State {
  std::map<std::string, std::size_t> names;
  std::set<std::string> folders;
  std::map<std::size_t, std::string> contents;

  void apply(const Step& step, std::size_t most = SIZE_MAX) {
    std::string& bytes = contents[step.file];
    switch (step.op) {
      case WriteOp::kCreate:
      case WriteOp::kLink:
        if (!step.path.empty()) names[step.path] = step.file;
        break;
      case WriteOp::kWrite: {
        const std::size_t size = std::min(step.data.size(), most);
        if (bytes.size() < step.offset + size) bytes.resize(step.offset + size);
        bytes.replace(step.offset, size, step.data, 0, size);
        break;
      }
      case WriteOp::kResize:
        bytes.resize(step.offset);
        break;
      case WriteOp::kGrow:
        bytes.resize(std::max<std::size_t>(bytes.size(), step.offset));
        break;
      case WriteOp::kRename:
        names.erase(step.path);
        names[step.other] = step.file;
        break;
      case WriteOp::kRemove:
        names.erase(step.path);
        folders.erase(step.path);
        break;
      case WriteOp::kMakeFolder:
        folders.insert(step.path);
        break;
      case WriteOp::kSync:
      case WriteOp::kSyncFolder:
        break;
    }
  }

  // As files_in() would find it; what lies in no folder is lost.
  Files files() const {
    Files found;
    const auto reachable = [&](const std::string& path) {
      for (std::string above = parent_of(path); !above.empty(); above = parent_of(above))
        if (!folders.contains(above)) return false;
      return true;
    };
    for (const std::string& folder : folders)
      if (reachable(folder)) found[folder + "/"];
    for (const auto& [path, file] : names)
      if (reachable(path)) found[path] = contents.contains(file) ? contents.at(file) : "";
    return found;
  }
};

State state_of(const Files& files) {
  State state;
  for (const auto& [path, content] : files) {
    if (path.ends_with('/')) {
      state.folders.insert(path.substr(0, path.size() - 1));
      continue;
    }
    state.names[path] = state.contents.size();
    state.contents[state.contents.size()] = content;
  }
  return state;
}

// `before` is the state the log begins at.
std::vector<Step> read_log(const std::string& log, const fs::path& folder, const State& before) {
  std::vector<Step> steps;
  std::map<std::uint64_t, std::size_t> file_of;  // inode -> file
  std::size_t files = before.contents.size();
  std::map<std::string, std::size_t> names = before.names;
  const std::string root = folder.string() + "/";
  for (std::size_t at = 0; at < log.size();) {
    WriteRecord record;
    std::memcpy(&record, log.data() + at, sizeof record);
    at += sizeof record;
    const auto take = [&](std::size_t size) { return log.substr(std::exchange(at, at + size), size); };
    const auto place = [&](const std::string& path) {
      std::string inside = (path + "/").starts_with(root) ? path.substr(std::min(root.size(), path.size())) : path;
      while (inside.ends_with("/")) inside.pop_back();
      return inside;
    };
    Step step{record.op, 0, record.offset, {}, {}, {}};
    step.path = place(take(record.path_size));
    step.other = place(take(record.other_size));
    step.data = take(record.data_size);
    if (step.op == WriteOp::kCreate) file_of[record.inode] = files++;
    step.file = record.inode != 0 ? file_of[record.inode] : 0;
    if (step.op == WriteOp::kRename) step.file = names.at(step.path);
    if (step.op == WriteOp::kRename) names[step.other] = step.file, names.erase(step.path);
    if (step.op == WriteOp::kCreate || step.op == WriteOp::kLink) names[step.path] = step.file;
    steps.push_back(std::move(step));
  }
  return steps;
}

State crashed(State state, const std::vector<Step>& steps, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) state.apply(steps[i], i + 1 == n ? steps[i].data.size() / 2 : SIZE_MAX);
  return state;
}

State without_power(State state, const std::vector<Step>& steps, std::size_t n, std::mt19937& random) {
  std::set<std::size_t> synced;         // files whose writes up to here are on disk
  std::set<std::string> synced_folder;  // folders whose names are
  std::vector<std::size_t> most(n);
  for (std::size_t i = n; i-- > 0;) {
    const Step& step = steps[i];
    const std::string folder = parent_of(step.op == WriteOp::kRename ? step.other : step.path);
    if (step.op == WriteOp::kSync) synced.insert(step.file);
    if (step.op == WriteOp::kSyncFolder) synced_folder.insert(step.path);
    const bool of_content = step.op == WriteOp::kWrite || step.op == WriteOp::kResize || step.op == WriteOp::kGrow;
    const bool durable = of_content ? synced.contains(step.file) : synced_folder.contains(folder);
    const auto luck = random() % 20;
    most[i] = durable || luck >= 13 ? SIZE_MAX : luck >= 10 ? step.data.size() / 2 + 1 : 0;
  }
  for (std::size_t i = 0; i < n; ++i)
    if (most[i] > 0) state.apply(steps[i], most[i]);
  return state;
}

// A command that writes below `run`, and, where it makes one, its map.
struct Scene {
  std::string name;
  std::vector<std::string> arguments;
  std::string over = {};  // a map that is in the place of the new one
};

class Trial {
 public:
  explicit Trial(unsigned seed) : run_(folder_.path() / "run"), random_(seed) {
    const auto need = [](const Outcome& outcome) {
      if (outcome.status != 0) throw Error(ErrorCode::kFailed, "the trial could not be set up: " + outcome.err);
    };
    const std::string city = at("city"), map = at("map.btms"), out = (run_ / "out/new").string();
    need(test::run({"synth", "--scene", "city", "--points", "40000", "-o", city}));
    need(test::run({"build", city, "-o", map, "--resolution", "4"}));
    scenes_ = {{"build", {"build", city, "-o", out}},
               {"rebuild", {"build", city, "-o", out}, map},
               {"rebuild by 2 ranks", {"build", city, "-o", out, "--executor", "ranks:2"}, map},
               {"rebuild, unchanged", {"build", city, "-o", out, "--resolution", "4"}, map},
               {"label", {"label", map, city, "-o", out}},
               {"synth", {"synth", "--points", "20000", "--density", "2", "--files", "2", "-o", out}}};
  }

  void play(std::size_t cuts) {
    for (const Scene& scene : scenes_) play(scene, cuts);
  }

  std::size_t boundaries = 0, states = 0, rebuilt = 0, bad = 0;

 private:
  // Where a command stands at a boundary.
  enum class Progress { kBefore, kCommitting, kDone };

  void play(const Scene& scene, std::size_t cuts) {
    fs::remove_all(run_);
    fs::create_directory(run_);
    if (!scene.over.empty()) {
      fs::create_directories(run_ / "out");
      fs::copy(scene.over, run_ / "out/new", fs::copy_options::recursive);
    }
    const Files before = files_in(run_);
    const State begin = state_of(before);
    const std::string old_digest = map_digest(run_ / "out/new");
    const Disturbed done = run_disturbed(scene.arguments, {{"BTMS_FAULTS_LOG", at("log")}});
    if (done.outcome.status != 0) throw Error(ErrorCode::kFailed, scene.name + ": " + done.outcome.err);
    const Files after = files_in(run_);
    const std::string new_digest = map_digest(run_ / "out/new");
    const std::vector<Step> steps = read_log(read_text(at("log")), run_, begin);
    State all = begin;
    for (const Step& step : steps) all.apply(step);
    if (all.files() != after) throw Error(ErrorCode::kFailed, scene.name + ": the log is not all that was written");

    const bool is_map = scene.arguments[0] == "build";
    const std::string manifest = "out/new/manifest.json";
    std::size_t commit = steps.size(), durable = steps.size();
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string& name = steps[i].op == WriteOp::kRename ? steps[i].other : steps[i].path;
      if ((steps[i].op == WriteOp::kRename || steps[i].op == WriteOp::kLink) && name == manifest) commit = i;
      if (commit < i && durable == steps.size() && steps[i].op == WriteOp::kSyncFolder && steps[i].path == "out/new")
        durable = i;
    }
    std::printf("%-20s %zu writes", scene.name.c_str(), steps.size());
    if (is_map) std::printf(", commit at %zu, durable at %zu", commit + 1, durable + 1);
    std::printf("\n");
    std::fflush(stdout);

    const auto judge = [&](const State& state, std::size_t n, bool power) -> std::string {
      const Files found = state.files();
      if (is_map) {
        write(found);
        const std::string digest = map_digest(work() / "out/new");
        const bool may_be_old = power ? n <= durable : n <= commit, may_be_new = n > commit;
        if ((digest == old_digest && may_be_old) || (digest == new_digest && may_be_new)) return {};
        return digest.empty() ? "the map is gone" : "the map is of the other side of the commit";
      }
      for (const auto& [name, content] : after)
        if (found.contains(name) ? found.at(name) != content : n == steps.size()) return name + " is not whole";
      return {};
    };
    for (std::size_t n = 0; n <= steps.size(); ++n) {
      ++boundaries;
      for (std::size_t cut = 0; cut <= cuts; ++cut) {
        const bool power = cut > 0;
        const State state = power ? without_power(begin, steps, n, random_) : crashed(begin, steps, n);
        ++states;
        std::string wrong;
        try {
          wrong = judge(state, n, power);
          // Now and then: the same command, run again on what is left, makes the same.
          const bool delicate = n > commit && n <= commit + 3 && cut <= 8;
          if (wrong.empty() && is_map && (delicate || (n % 4 == 0 && cut == n % (cuts + 1))))
            wrong = again(scene, new_digest);
        } catch (const Error& e) {
          wrong = e.what();
        }
        if (wrong.empty()) continue;
        ++bad;
        std::printf("BAD %s, %s after write %zu: %s\n", scene.name.c_str(), power ? "power cut" : "crash", n,
                    wrong.c_str());
      }
    }
  }

  std::string again(const Scene& scene, const std::string& digest) {
    std::vector<std::string> arguments = scene.arguments;
    for (std::string& word : arguments)
      if (word.starts_with(run_.string())) word.replace(0, run_.string().size(), work().string());
    const Outcome outcome = test::run(arguments);
    ++rebuilt;
    if (outcome.status != 0) return "can't be built again: " + outcome.err;
    if (map_digest(work() / "out/new") != digest) return "built again it differs";
    const std::string left = temporary_in(work());
    return left.empty() ? "" : "built again, there is " + left;
  }

  fs::path work() const { return folder_.path() / "work"; }
  void write(const Files& files) const {
    fs::remove_all(work());
    fs::create_directory(work());
    for (const auto& [name, content] : files) {  // a folder comes before what is in it
      if (name.ends_with('/'))
        fs::create_directories(work() / name);
      else
        write_text(work() / name, content);
    }
  }
  std::string at(const std::string& name) const { return folder_ / name; }

  TempFolder folder_;
  const fs::path run_;
  std::mt19937 random_;
  std::vector<Scene> scenes_;
};

int run_trial(std::size_t cuts, unsigned seed) {
  Trial trial(seed);
  trial.play(cuts);
  std::printf("%zu boundaries, %zu states, %zu built again: %zu bad\n", trial.boundaries, trial.states, trial.rebuilt,
              trial.bad);
  return trial.bad == 0 ? 0 : 1;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Replays every write boundary of logged commands: the old result or the new one, whole");
  std::size_t cuts = 20;
  unsigned seed = 1;
  app.add_option("cuts", cuts, "Power cuts at every boundary");
  app.add_option("--seed", seed, "Others");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::test::run_trial(cuts, seed);
  } catch (const std::exception& error) {
    std::printf("BAD %s\n", error.what());
    return 1;
  }
}
