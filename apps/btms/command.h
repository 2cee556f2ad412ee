// A subcommand as main.cpp sees it. Every subcommand lives in the file of its name.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

#include "apps/btms/common_options.h"

namespace btms {

struct Command {
  CLI::App* app = nullptr;
  std::shared_ptr<const CommonOptions> common;
  std::function<int()> run;  // returns the exit status; may throw Error
};

Command add_build(CLI::App& btms);
Command add_join(CLI::App& btms);
Command add_label(CLI::App& btms);
Command add_segment(CLI::App& btms);
Command add_info(CLI::App& btms);
Command add_query(CLI::App& btms);
Command add_route(CLI::App& btms);
Command add_export(CLI::App& btms);
Command add_digest(CLI::App& btms);
Command add_verify(CLI::App& btms);
Command add_diff(CLI::App& btms);
Command add_eval(CLI::App& btms);
Command add_params(CLI::App& btms);
Command add_sweep(CLI::App& btms);
Command add_synth(CLI::App& btms);
Command add_accumulate(CLI::App& btms);
Command add_serve(CLI::App& btms);
Command add_man(CLI::App& btms);
Command add_completion(CLI::App& btms);

}  // namespace btms
