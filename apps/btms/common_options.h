// Options that mean the same in every subcommand.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "apps/btms/progress_display.h"
#include "engine/tiling/executor.h"

namespace btms {

struct CommonOptions {
  bool json = false;
  bool quiet = false;
  std::string log_level = "info";
  int threads = 0;  // 0 = as many as the machine has
  std::string progress = "auto";

  int thread_count() const;
  ProgressStyle progress_style() const;
};

// --json, --quiet, --log-level: for every subcommand.
void add_output_options(CLI::App& app, CommonOptions& options);
// --threads and --progress: for those that work for a while.
void add_run_options(CLI::App& app, CommonOptions& options);

// Sends the log to stderr, at the level asked for.
void start_log(const CommonOptions& options);

// oneTBB for several threads, plain loops for one.
std::unique_ptr<Threads> make_threads(int count);

}  // namespace btms
