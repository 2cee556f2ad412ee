// btms label: the points of the inputs, labelled against a finished map.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/label_report.h"
#include "apps/btms/memory_option.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/tiling/label.h"

namespace btms {
namespace {

struct LabelCommand {
  CommonOptions common;
  MemoryOption memory;
  std::string map, output;
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

int run_label(const LabelCommand& command) {
  const auto reader = open_map(command.map);
  const InputList list = expand_inputs(command.inputs);
  const PointFiles files = open_all(list.paths);
  log_warnings(list, files);
  prepare_label_folder(files, command.output, command.force);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  const std::size_t cache_bytes = label_cache_bytes(command.memory.limit(), threads->count());
  LabelReport report;
  report.warnings = list.warnings;
  ProgressDisplay display(command.common.progress_style());
  display.begin("label", total_points(files), "points");
  OnePhase progress(display);
  const auto begun = std::chrono::steady_clock::now();
  for (const auto& file : files) {
    const auto writer = create_labels(*file, command.output);
    const auto write = [&](std::uint64_t first, std::span<const Label> labels, PointBlock& block) {
      writer->write(first, labels, block);
    };
    const LabelCounts counts =
        label_points(*file, *reader, reader->info().parameters, *threads, write, progress, cache_bytes);
    throw_if_stopped();
    const std::string warning = check_cover(*file, counts, command.map);
    if (!warning.empty()) report.warnings.push_back(warning);
    writer->commit();
    report.add(*file, writer->path(), counts);
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  display.finish();
  for (std::size_t i = list.warnings.size(); i < report.warnings.size(); ++i) spdlog::warn("{}", report.warnings[i]);
  report.print(command.common.json);
  return 0;
}

constexpr const char* kFooter =
    "Example:\n"
    "  btms label city.btms tiles/ -o labelled/\n"
    "\n"
    "Parameters come from the map. Names are kept. What is written, one label per input point, in input order:\n"
    "  .las -> .las    a copy: class 2 ground, 1 not, 7 far below; a dropped point keeps its class\n"
    "  .laz -> .las    the same, not compressed: there is no encoder\n"
    "  .bin -> .label  u32: 40 terrain, 99 not, 0 dropped\n"
    "  .pcd, .ply, .npy -> .labels u8: 1 terrain, 0 not";

}  // namespace

Command add_label(CLI::App& btms) {
  auto command = std::make_shared<LabelCommand>();
  CLI::App* app = btms.add_subcommand("label", "Label points as ground or not, against a finished map");
  app->footer(kFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option("INPUT", command->inputs, "Point files, folders of them, or globs")
      ->required()
      ->default_str("")
      ->type_name("");
  app->add_option("-o,--output", command->output, "Folder for the results; made when missing")
      ->required()
      ->type_name("DIR");
  add_force_option(*app, command->force);
  command->memory.add_to(*app, false);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_label(*command); }};
}

}  // namespace btms
