#include "apps/btms/common_options.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <thread>

namespace btms {

int CommonOptions::thread_count() const {
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

ProgressStyle CommonOptions::progress_style() const {
  if (quiet || progress == "none") return ProgressStyle::kNone;
  if (progress == "bar") return ProgressStyle::kBar;
  if (progress == "lines") return ProgressStyle::kLines;
  if (progress == "json") return ProgressStyle::kJson;
  return isatty(STDERR_FILENO) != 0 ? ProgressStyle::kBar : ProgressStyle::kLines;
}

void add_output_options(CLI::App& app, CommonOptions& options) {
  app.add_flag("--json", options.json, "Print one JSON object on stdout instead of text")->group("Output");
  app.add_flag("-q,--quiet", options.quiet, "No progress, and only errors on stderr")->group("Output");
  app.add_option("--log-level", options.log_level, "What reaches stderr: debug, info, warn, error")
      ->check(CLI::IsMember({"debug", "info", "warn", "error"}))
      ->type_name("LEVEL")
      ->group("Output");
}

void add_run_options(CLI::App& app, CommonOptions& options) {
  app.add_option("-j,--threads", options.threads, "Threads to use (default: all of the machine)")
      ->check(CLI::Range(1, 1024))
      ->default_str("")
      ->type_name("N")
      ->group("Running");
  app.add_option("--progress", options.progress,
                 "bar, lines, json (an object a line on stderr) or none; auto is a bar on a terminal and a line every "
                 "few seconds "
                 "otherwise")
      ->check(CLI::IsMember({"auto", "bar", "lines", "json", "none"}))
      ->type_name("STYLE")
      ->group("Running");
}

void start_log(const CommonOptions& options) {
  auto log = std::make_shared<spdlog::logger>("btms", std::make_shared<spdlog::sinks::stderr_color_sink_st>());
  log->set_pattern("%n: %^%l%$: %v");
  log->set_level(options.quiet ? spdlog::level::err : spdlog::level::from_str(options.log_level));
  log->flush_on(spdlog::level::debug);
  spdlog::set_default_logger(std::move(log));
}

std::unique_ptr<Threads> make_threads(int count) { return count == 1 ? serial_threads() : tbb_threads(count); }

}  // namespace btms
