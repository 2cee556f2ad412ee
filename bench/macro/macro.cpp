// btms_macro: whole runs of the program, LAS files to map on disk to classified LAS files, as child processes.
//
// Every answer is verified before its time is believed: the digest is the same for any number of threads and in every
// repetition, every point has a label, the labels' errors against the scene's truth are the same for any number of
// threads and not far from what the method can do. A wrong one ends the run. docs/performance.md says how to read the
// table.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "bench/macro/row.h"
#include "io/points/point_file.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> sizes = {"1M", "10M", "50M", "200M"}, methods = {"city", "fixed2", "fixed4"};
  std::vector<int> threads = {1, 2};
  int repetitions = 0;
  double peer_points_M = 10;
  fs::path folder = fs::temp_directory_path(), json, compare, program, peers;
  std::string memory;
  bool keep = false;
};

struct Method {
  const char *option, *name;
  std::vector<std::string> arguments;
  double worst_error;  // only tells a working method from a broken one
};

const std::vector<Method>& methods() {
  static const std::vector<Method> all = {
      {"city", "city", {"--preset", "city"}, 0.02},
      {"fixed2", "fixed r=2", {"--preset", "city", "--method", "fixed", "--resolution", "2"}, 0.35},
      {"fixed4", "fixed r=4", {"--preset", "city", "--method", "fixed", "--resolution", "4"}, 0.35}};
  return all;
}

// How each was tuned: docs/performance.md.
struct Peer {
  const char* name;
  std::vector<std::string> arguments;
  bool threaded;
};

const std::vector<Peer>& peers() {
  static const std::vector<Peer> all = {
      {"pcl pmf 0.7 m", {"pmf", "--cell", "0.7", "--window", "65", "--initial", "0.4"}, true},
      {"pcl pmf 2 m", {"pmf", "--cell", "2", "--window", "33", "--initial", "0.9"}, true},
      {"pcl ransac", {"ransac", "--thickness", "4"}, false}};
  return all;
}

[[noreturn]] void wrong(const std::string& what) { throw std::runtime_error("wrong answer: " + what); }

std::uint64_t parse_size(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const std::string unit = end;
  const double factor = unit == "k" ? 1e3 : unit == "M" ? 1e6 : unit == "G" ? 1e9 : unit.empty() ? 1 : 0;
  if (!(number * factor >= 1e4 && number * factor <= 1e11))
    throw std::runtime_error(
        fmt::format("--sizes: found `{}`, expected a number of points like 500k, 10M or 1G", text));
  return static_cast<std::uint64_t>(number * factor);
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// Predictions against the truth in the inputs, file by file. By the program, not here: a process that has held much
// memory hands its peak on to its children.
Confusion score_labels(const fs::path& program, const std::vector<fs::path>& truths, const fs::path& labels) {
  Confusion sum;
  for (const fs::path& path : truths) {
    const ChildRun run = run_child({program.string(), "eval", "--truth", path.string(), "--prediction",
                                    (labels / path.filename()).string(), "--json", "--quiet"});
    const Json counts = Json::parse(run.output).at("files").at(0).at("with_ambiguous");
    const auto of = [&](const char* name) { return counts.at(name).get<std::uint64_t>(); };
    sum += {of("true_positive"), of("false_positive"), of("false_negative"), of("true_negative")};
  }
  return sum;
}

bool equal(const Confusion& a, const Confusion& b) {
  return a.true_positive == b.true_positive && a.false_positive == b.false_positive &&
         a.false_negative == b.false_negative && a.true_negative == b.true_negative;
}

Cost sum(const Cost& a, const Cost& b) {
  return {a.wall_s + b.wall_s,         a.user_s + b.user_s,
          a.system_s + b.system_s,     std::max(a.peak_rss_bytes, b.peak_rss_bytes),
          a.read_bytes + b.read_bytes, a.written_bytes + b.written_bytes};
}

// What the repetitions of one method, size and number of threads gave.
struct Measured {
  std::vector<Cost> build, label, both;
  double points_per_node = 0;
};

// The runs of one size.
class Bench {
 public:
  Bench(const Options& options, std::uint64_t wanted) : options_(options), wanted_(wanted) {
    work_ = options.folder / fmt::format("btms_macro_{}", wanted);
    input_ = work_ / "input";
    make_input();
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() {
    std::error_code ignored;
    fs::remove_all(options_.keep ? output() : work_, ignored);
  }

  std::vector<Row> run() {
    const int repetitions = options_.repetitions > 0 ? options_.repetitions
                            : wanted_ <= 1'000'000   ? 7
                            : wanted_ <= 10'000'000  ? 3
                                                     : 1;
    std::map<std::pair<const Method*, int>, Measured> measured;
    std::map<std::pair<const Peer*, int>, Measured> by_peer;
    std::map<std::pair<const Peer*, int>, std::vector<double>> filter_s;
    std::vector<double> copies_s;
    for (int i = 0; i < repetitions; ++i) {
      for (const Method& method : methods()) {
        if (std::count(options_.methods.begin(), options_.methods.end(), method.option) == 0) continue;
        copies_s.push_back(copy());
        for (const int threads : options_.threads) run_method(method, threads, measured[{&method, threads}]);
      }
      if (options_.peers.empty() || static_cast<double>(wanted_) > options_.peer_points_M * 1e6) continue;
      for (const Peer& peer : peers()) {
        copies_s.push_back(copy());
        for (const int threads : options_.threads)
          if (peer.threaded || threads == options_.threads.front())
            run_peer(peer, threads, by_peer[{&peer, threads}], filter_s[{&peer, threads}]);
      }
    }

    std::vector<Row> rows;
    const auto add = [&](const char* name, const char* job, int threads, const std::vector<Cost>& costs) -> Row& {
      Row row;
      row.method = name;
      row.job = job;
      row.points = points_;
      row.threads = threads;
      row.repetitions = repetitions;
      row.cost = median(costs);
      row.least_wall_s = std::min_element(costs.begin(), costs.end(), [](const Cost& a, const Cost& b) {
                           return a.wall_s < b.wall_s;
                         })->wall_s;
      row.copy_s = median(copies_s);
      for (const Row& other : rows)
        if (other.method == row.method && other.job == row.job && other.threads == 1 && threads > 1)
          row.thread_gain = other.cost.wall_s / row.cost.wall_s;
      return rows.emplace_back(std::move(row));
    };
    for (const Method& method : methods())
      for (const int threads : options_.threads) {
        const auto found = measured.find({&method, threads});
        if (found == measured.end()) continue;
        const Measured& m = found->second;
        for (const auto& [job, costs] : {std::pair{"build", &m.build}, {"label", &m.label}, {"both", &m.both}}) {
          Row& row = add(method.name, job, threads, *costs);
          row.points_per_node = m.points_per_node;
          if (costs != &m.build) row.labels = labels_.at(method.name);
        }
      }
    for (const Peer& peer : peers())
      for (const int threads : options_.threads)
        if (const auto found = by_peer.find({&peer, threads}); found != by_peer.end()) {
          Row& row = add(peer.name, "both", threads, found->second.both);
          row.filter_s = median(filter_s[{&peer, threads}]);
          row.labels = labels_.at(peer.name);
        }
    return rows;
  }

 private:
  fs::path output() const { return work_ / "output"; }

  // Kept inputs are used again: equal options give equal files.
  void make_input() {
    if (!fs::exists(input_)) {
      fs::remove_all(work_);
      run_child({options_.program.string(), "synth", "--scene", "city", "--points", std::to_string(wanted_),
                 "--point-format", "0", "-o", (work_ / "made").string(), "--json", "--progress", "none"});
      fs::rename(work_ / "made", input_);
    }
    files_ = files_in(input_);
    for (const fs::path& file : files_) points_ += open_points(file)->info().points;
  }

  // Nothing is left to be written to the disk, and the output does not exist.
  void start_afresh() const {
    fs::remove_all(output());
    fs::create_directories(output());
    ::sync();
  }

  double copy() const {
    start_afresh();
    std::vector<std::string> command = {"cp", "--reflink=never"};
    for (const fs::path& file : files_) command.push_back(file.string());
    command.push_back(output().string());
    return run_child(command).cost.wall_s;
  }

  void check_labels(const std::string& name, const fs::path& folder, double worst_error) {
    const Confusion now = score_labels(options_.program, files_, folder);
    const auto [before, is_new] = labels_.emplace(name, now);
    if (!equal(before->second, now)) wrong(name + ": the labels depend on the number of threads");
    if (now.total_error() > worst_error)
      wrong(fmt::format("{}: {:.1f} % of the labels are wrong", name, 100 * now.total_error()));
  }

  void run_method(const Method& method, int threads, Measured& measured) {
    start_afresh();
    const std::string map = (output() / "map").string(), labels = (output() / "labels").string();
    const std::vector<std::string> common = {"--threads", std::to_string(threads), "--json", "--quiet"};
    std::vector<std::string> build = {options_.program.string(), "build", input_.string(), "-o", map};
    build.insert(build.end(), method.arguments.begin(), method.arguments.end());
    build.insert(build.end(), common.begin(), common.end());
    if (!options_.memory.empty()) build.insert(build.end(), {"--memory", options_.memory});
    std::vector<std::string> label = {options_.program.string(), "label", map, input_.string(), "-o", labels};
    label.insert(label.end(), common.begin(), common.end());
    const ChildRun built = run_child(build), labelled = run_child(label);

    const Json model = Json::parse(built.output), counts = Json::parse(labelled.output).at("total");
    const std::string digest = model.at("digest");
    const auto [before, is_new] = digests_.emplace(method.name, digest);
    if (before->second != digest) wrong(fmt::format("{}: digests {} and {}", method.name, before->second, digest));
    std::uint64_t labels_given = 0;
    for (const char* kind : {"terrain", "obstacle", "below"}) labels_given += counts.at(kind).get<std::uint64_t>();
    if (model.at("points") != points_ || labels_given != points_)
      wrong(std::string(method.name) + ": points are missing");
    if (measured.both.empty()) check_labels(method.name, labels, method.worst_error);

    const Json& nodes = model.at("nodes");
    measured.points_per_node =
        static_cast<double>(points_) / (nodes.at("total").get<double>() - nodes.at("filled").get<double>());
    measured.build.push_back(built.cost);
    measured.label.push_back(labelled.cost);
    measured.both.push_back(sum(built.cost, labelled.cost));
  }

  void run_peer(const Peer& peer, int threads, Measured& measured, std::vector<double>& filter_s) {
    start_afresh();
    std::vector<std::string> command = {options_.peers.string()};
    command.insert(command.end(), peer.arguments.begin(), peer.arguments.end());
    command.insert(command.end(), {"--threads", std::to_string(threads), "-o", output().string()});
    for (const fs::path& file : files_) command.push_back(file.string());
    const ChildRun run = run_child(command);
    if (measured.both.empty()) check_labels(peer.name, output(), 1);
    filter_s.push_back(Json::parse(run.output).at("filter_seconds"));
    measured.both.push_back(run.cost);
  }

  const Options& options_;
  std::uint64_t wanted_, points_ = 0;
  fs::path work_, input_;
  std::vector<fs::path> files_;
  std::map<std::string, std::string> digests_;
  std::map<std::string, Confusion> labels_;
};

int run(const Options& options) {
  std::vector<Row> old, rows;
  if (!options.compare.empty()) {
    std::ifstream file(options.compare);
    const Json earlier = Json::parse(file);
    for (const Json& row : earlier.at("rows")) old.push_back(row_from_json(row));
  }
  std::vector<std::uint64_t> sizes;
  for (const std::string& size : options.sizes) sizes.push_back(parse_size(size));
  print_heading();
  for (const std::uint64_t points : sizes)
    for (const Row& row : Bench(options, points).run()) {
      print_row(row);
      rows.push_back(row);
    }
  if (!options.json.empty()) {
    Json json{{"memory", options.memory}, {"rows", Json::array()}};
    for (const Row& row : rows) json["rows"].push_back(to_json(row));
    std::ofstream file(options.json);
    if (!(file << json.dump(1) << '\n')) throw std::runtime_error("cannot write " + options.json.string());
  }
  if (!options.compare.empty()) print_comparison(rows, old);
  return 0;
}

}  // namespace
}  // namespace btms::bench

int main(int argc, char** argv) {
  using btms::bench::Options;
  Options options;
  const auto here = std::filesystem::canonical("/proc/self/exe").parent_path();
  options.program = here / "btms";
  if (std::filesystem::exists(here / "btms_pcl")) options.peers = here / "btms_pcl";
  CLI::App app("Whole runs of btms on synthetic cities, timed as child processes, as a table", "btms_macro");
  app.option_defaults()->always_capture_default();
  app.add_option("--sizes", options.sizes, "Points, e.g. 1M,10M,1G")->delimiter(',')->type_name("N,..");
  app.add_option("--methods", options.methods, "Of city, fixed2, fixed4; none for the peers alone")
      ->delimiter(',')
      ->check(CLI::IsMember({"city", "fixed2", "fixed4", "none"}))
      ->type_name("M,..");
  app.add_option("--threads", options.threads, "Numbers of threads")->delimiter(',')->type_name("N,..");
  app.add_option("--repetitions", options.repetitions, "0: 7 up to 1 M points, 3 up to 10 M, else 1")->type_name("N");
  app.add_option("--memory", options.memory, "Handed on to btms build")->type_name("SIZE");
  app.add_option("--dir", options.folder, "Where inputs and outputs are made: on a disk or a tmpfs")->type_name("DIR");
  app.add_flag("--keep", options.keep, "Leave the inputs for the next run");
  app.add_option("--json", options.json, "Write the rows to this file too")->type_name("FILE");
  app.add_option("--compare", options.compare, "An earlier --json: print new over old")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  app.add_option("--program", options.program, "The btms to run")->check(CLI::ExistingFile)->type_name("FILE");
  app.add_option("--peers", options.peers, "The btms_pcl to run too; empty for none")->type_name("FILE");
  app.add_option("--peer-points", options.peer_points_M, "Largest size for the peers, in millions")->type_name("M");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::bench::run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "btms_macro: {}\n", error.what());
    return 1;
  }
}
