// btms segment: single scans, each with its own model, in memory.
#include <spdlog/spdlog.h>

#include <chrono>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/label_report.h"
#include "apps/btms/outputs.h"
#include "apps/btms/parameter_options.h"
#include "apps/btms/stop_signal.h"
#include "engine/tiling/block_source.h"
#include "engine/tiling/scan_segmenter.h"

namespace btms {
namespace {

using Clock = std::chrono::steady_clock;

struct SegmentCommand {
  CommonOptions common;
  PointFileOptions points;
  ParameterOptions parameters;
  std::vector<std::string> scans;
  std::string output;
  bool force = false;
};

double seconds_since(Clock::time_point begun) { return std::chrono::duration<double>(Clock::now() - begun).count(); }

// Segments one scan and writes its labels. Returns the seconds the engine took.
double segment_one(const PointFile& file, ScanSegmenter& segmenter, const std::string& folder,
                   LabelReport::File& result) {
  PointBlock points;  // in memory, so that the time is the engine's alone
  file.read(0, static_cast<std::size_t>(file.size()), points);
  const auto begun = Clock::now();
  const std::span<const Label> labels = segmenter.segment(BlockSource(points, file.name()));
  const double seconds = seconds_since(begun);
  const auto writer = create_labels(file, folder);
  writer->write(0, labels);
  throw_if_stopped();
  writer->commit();
  result = {file.path(), writer->path(), file.size(), segmenter.counts()};
  return seconds;
}

int run_segment(const SegmentCommand& command) {
  const ParameterChoice choice = command.parameters.resolve();
  const InputList list = expand_inputs(command.scans);
  const PointFiles files = open_all(list.paths, command.points);
  log_warnings(list, files);
  prepare_label_folder(files, command.output, command.force);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  progress.begin("segment", total_points(files), "points");
  LabelReport report;
  report.warnings = list.warnings;
  report.files.resize(files.size());
  std::vector<double> seconds(files.size());
  std::vector<ScanSegmenter> segmenters;  // one a worker
  for (int i = 0; i < threads->count(); ++i) segmenters.emplace_back(choice.parameters);
  const auto begun = Clock::now();
  threads->for_each(files.size(), [&](std::size_t i, int worker) {
    throw_if_stopped();
    seconds[i] = segment_one(*files[i], segmenters[static_cast<std::size_t>(worker)], command.output, report.files[i]);
    progress.advance(files[i]->size());
  });
  report.seconds = seconds_since(begun);
  progress.finish();

  double sum = 0;
  for (const double s : seconds) sum += s;
  report.mean_scan_seconds = sum / static_cast<double>(seconds.size());
  for (const LabelReport::File& file : report.files)
    if (file.counts.dropped == file.points) report.warnings.push_back(file.input.string() + ": no point to segment");
  for (std::size_t i = list.warnings.size(); i < report.warnings.size(); ++i) spdlog::warn("{}", report.warnings[i]);
  report.print(command.common.json);
  return 0;
}

constexpr const char* kSegmentFooter =
    "Example:\n"
    "  btms segment sequences/00/velodyne/*.bin -o predictions/\n"
    "  btms segment sequences/00/velodyne/*.bin -o predictions/ --preset paper-single-scan   # ten times as fast\n"
    "\n"
    "Every scan is segmented alone, by one thread; several scans run at a time (see --threads). The time per scan\n"
    "leaves file access out. Labels are written as by `btms label`; steps and costs, which nobody would read, are not\n"
    "worked out. An empty scan gives an empty label file.";

}  // namespace

Command add_segment(CLI::App& btms) {
  auto command = std::make_shared<SegmentCommand>();
  CLI::App* app = btms.add_subcommand("segment", "Label single scans, each on its own, in memory");
  app->footer(kSegmentFooter);
  app->add_option("SCAN", command->scans, "Point files, folders of them, or globs")
      ->required()
      ->default_str("")
      ->type_name("");
  app->add_option("-o,--output", command->output, "Folder for the labels; made when missing")
      ->required()
      ->type_name("DIR");
  add_columns_option(*app, command->points);
  add_force_option(*app, command->force);
  add_run_options(*app, command->common);
  command->parameters.add_to(*app, "single-scan");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_segment(*command); }};
}

}  // namespace btms
