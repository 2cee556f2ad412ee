// btms label: the points of the inputs, labelled against a finished map.
#include <spdlog/fmt/fmt.h>

#include <chrono>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/label_report.h"
#include "apps/btms/stop_signal.h"
#include "apps/btms/tile_cache.h"
#include "engine/tiling/label.h"
#include "io/store/map_store.h"

namespace btms {
namespace {

struct LabelCommand {
  CommonOptions common;
  std::string map, output;
  std::vector<std::string> inputs;
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

int run_label(const LabelCommand& command) {
  const auto reader = MapReader::open(command.map);
  const TileCache map(*reader);
  const auto paths = expand_inputs(command.inputs);
  const PointFiles files = open_all(paths);
  log_warnings(files);
  prepare_output_folder(files, command.output);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  LabelReport report;
  ProgressDisplay display(command.common.progress_style());
  display.begin("label", total_points(files), "points");
  OnePhase progress(display);
  const auto begun = std::chrono::steady_clock::now();
  for (const auto& file : files) {
    const auto writer = create_labels(*file, command.output);
    const auto write = [&](std::uint64_t first, std::span<const Label> labels) { writer->write(first, labels); };
    const LabelCounts counts = label_points(*file, map, reader->info().parameters, *threads, write, progress);
    throw_if_stopped();
    writer->commit();
    report.add(*file, writer->path(), counts);
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  display.finish();
  report.print(command.common.json);
  return 0;
}

constexpr const char* kFooter =
    "Example:\n"
    "  btms label city.btms tiles/ -o labelled/\n"
    "\n"
    "Parameters come from the map. Names are kept. What is written, one label per input point, in input order:\n"
    "  .las -> .las    a copy: class 2 ground, 1 not, 7 far below; a dropped point keeps its class\n"
    "  .bin -> .label  u32: 40 terrain, 99 not, 0 dropped\n"
    "  .pcd -> .labels u8: 1 terrain, 0 not";

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
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_label(*command); }};
}

}  // namespace btms
