// btms label: the points of the inputs, labelled against a finished map.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <numeric>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/label_report.h"
#include "apps/btms/memory_option.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/process_group.h"
#include "apps/btms/reference_system.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/tiling/label.h"

namespace btms {
namespace {

struct LabelCommand {
  CommonOptions common;
  MemoryOption memory;
  std::string map, output;
  PointFileOptions points;
  std::vector<std::string> inputs;
  bool force = false;
};

// One bar over all files, although the engine begins a phase for each.
class OnePhase final : public Progress {
 public:
  explicit OnePhase(Progress& display) : display_(display) {}
  void advance(std::uint64_t done) override { display_.advance(done); }
  bool stop_requested() const override { return display_.stop_requested(); }

 private:
  Progress& display_;
};

// A map of another place calls everything an obstacle. Throws Error(kBadInput) when no point is over the map's surface;
// otherwise gives a warning when most are not, or nothing.
std::string check_cover(const PointFile& file, const LabelCounts& counts, const std::string& map) {
  const std::uint64_t points = file.size() - counts.dropped;
  if (2 * counts.outside <= points) return {};
  if (counts.outside == points)
    throw Error(ErrorCode::kBadInput,
                fmt::format("none of its points lies where {} has a surface: is it the map of this file?", map),
                file.path().string());
  return fmt::format("{}: {} % of the points lie where {} has no surface", file.path().string(),
                     percent_text(static_cast<double>(counts.outside) / static_cast<double>(points)), map);
}

// What the tiles at hand may take of the memory: all but the program and what threads work on.
std::size_t label_cache_bytes(std::uint64_t limit, int threads) {
  const std::uint64_t aside = (std::uint64_t{32} << 20) + (std::uint64_t{8} << 20) * static_cast<unsigned>(threads);
  return static_cast<std::size_t>(
      std::min<std::uint64_t>(kLabelCacheBytes, limit > 2 * aside ? limit - aside : limit / 2));
}

// The rank that labels each file: the largest goes first, to whom has least to do.
std::vector<int> share_out(const PointFiles& files, int ranks) {
  std::vector<std::size_t> order(files.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return files[i]->size(); });
  std::vector<std::uint64_t> points(static_cast<std::size_t>(ranks));
  std::vector<int> rank(files.size());
  for (const std::size_t i : order) {
    const auto least = std::ranges::min_element(points);
    *least += files[i]->size();
    rank[i] = static_cast<int>(least - points.begin());
  }
  return rank;
}

struct LabelledFile {
  std::size_t file;
  LabelCounts counts;
};

// What this rank does.
std::vector<LabelledFile> label_share(const LabelCommand& command, const PointFiles& files, const MapReader& map,
                                      const Ranks& ranks) {
  const std::vector<int> rank_of = share_out(files, ranks.size());
  std::uint64_t points = 0;
  for (std::size_t i = 0; i < files.size(); ++i)
    if (rank_of[i] == ranks.rank()) points += files[i]->size();
  const auto threads = make_threads(std::max(1, command.common.thread_count() / processes_here(1)));
  const std::size_t cache_bytes = label_cache_bytes(command.memory.limit(), threads->count());
  ProgressDisplay display(ranks.rank() == 0 ? command.common.progress_style() : ProgressStyle::kNone);
  display.begin("label", points, "points");
  OnePhase progress(display);
  std::vector<LabelledFile> done;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (rank_of[i] != ranks.rank()) continue;
    const auto writer = create_labels(*files[i], command.output);
    const auto write = [&](std::uint64_t first, std::span<const Label> labels, PointBlock& block) {
      writer->write(first, labels, block);
    };
    done.push_back({i, label_points(*files[i], map, map.info().parameters, *threads, write, progress, cache_bytes)});
    throw_if_stopped();
    check_cover(*files[i], done.back().counts, command.map);
    writer->commit();
  }
  display.finish();
  return done;
}

int run_label(const LabelCommand& command) {
  const auto reader = open_map(command.map);
  const InputList list = expand_inputs(command.inputs);
  PointFiles files = open_all(list.paths, command.points);
  std::vector<std::string> converted;
  if (!reader->info().crs_given) converted = convert_to(files, reader->info().crs_wkt);
  log_warnings(list, files);
  for (const std::string& sentence : converted) spdlog::warn("{}", sentence);
  prepare_label_folder(files, command.output, command.force);

  watch_stop_signals();
  LabelReport report;
  report.warnings = list.warnings;
  report.warnings.insert(report.warnings.end(), converted.begin(), converted.end());
  const auto begun = std::chrono::steady_clock::now();
  run_on_ranks(1, [&](Ranks& ranks) {
    std::vector<LabelledFile> done = ranks.gather(label_share(command, files, *reader, ranks));
    std::ranges::sort(done, {}, &LabelledFile::file);
    for (const auto& [i, counts] : done) report.add(*files[i], label_path(files[i]->path(), command.output), counts);
  });
  if (!is_first_process()) return 0;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string warning = check_cover(*files[i], report.files[i].counts, command.map);
    if (warning.empty()) continue;
    spdlog::warn("{}", warning);
    report.warnings.push_back(warning);
  }
  report.print(command.common.json);
  return 0;
}

constexpr const char* kLabelFooter =
    "Example:\n"
    "  btms label city.btms tiles/ -o labelled/\n"
    "\n"
    "Parameters come from the map. Names are kept. What is written, one label per input point, in input order:\n"
    "  .las -> .las    a copy: class 2 ground, 1 not, 7 far below; a dropped point keeps its class\n"
    "  .laz -> .las    the same, not compressed: there is no encoder\n"
    "  .bin -> .label  u32: 40 terrain, 99 not, 0 dropped\n"
    "  .pcd, .ply, .npy, text -> .labels u8: 1 terrain, 0 not";

}  // namespace

Command add_label(CLI::App& btms) {
  auto command = std::make_shared<LabelCommand>();
  CLI::App* app = btms.add_subcommand("label", "Label points as ground or not, against a finished map");
  app->footer(kLabelFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option("INPUT", command->inputs, "Point files, folders of them, or globs")
      ->required()
      ->default_str("")
      ->type_name("");
  app->add_option("-o,--output", command->output, "Folder for the results; made when missing")
      ->required()
      ->type_name("DIR");
  add_columns_option(*app, command->points);
  add_force_option(*app, command->force);
  command->memory.add_to(*app, false);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_label(*command); }};
}

}  // namespace btms
