// btms: the command line program. Parses, runs one subcommand, and turns errors into exit statuses.
#include <malloc.h>

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <new>
#include <span>
#include <thread>

#include "apps/btms/command.h"
#include "apps/btms/process_group.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"

namespace btms {
namespace {

constexpr const char* kDescription =
    "btms turns point clouds into one seamless terrain model, and labels every point as ground or not.";

constexpr const char* kMainFooter =
    "Example: a synthetic city, its map, and how well the ground was found\n"
    "  btms synth --scene city --points 2000000 -o demo\n"
    "  btms build demo -o demo/city.btms --picture demo/city.png\n"
    "  btms label demo/city.btms demo -o demo/labelled\n"
    "  btms eval --truth demo --prediction demo/labelled\n"
    "\n"
    "`btms SUBCOMMAND --help` explains each with its defaults.\n"
    "Data goes to stdout, log and progress to stderr. Exit status: 0 done, 1 failed, 2 usage,\n"
    "3 bad input data, 4 verification mismatch, 5 other parts have to run first, 130 stopped by the user.";

int report_error(const Error& error, const CommonOptions& common) {
  // What is wrong for all, the first process says; it ends the others, who get to say only what is wrong with them.
  if (!is_first_process()) std::this_thread::sleep_for(std::chrono::milliseconds(500));
  // A rank that was stopped takes the others with it: whatever they say, the user's signal was the cause.
  const ErrorCode code = stop_signalled() ? ErrorCode::kCancelled : error.code();
  if (code == ErrorCode::kCancelled)
    spdlog::error("stopped: what was finished stays, what was not is removed");
  else
    spdlog::error("{}", error.what());
  if (common.json) {
    Json object;
    Json& details = object["error"];
    details["code"] = error_name(code);
    details["message"] = error.what();
    if (!error.file().empty()) details["file"] = error.file();
    if (error.offset()) details["offset"] = *error.offset();
    print_json(object);
  }
  return exit_status(code);
}

int run(const Command& command) {
  start_log(*command.common);
  if (!is_first_process()) spdlog::set_level(spdlog::level::err);
  try {
    const int status = command.run();
    if (std::fflush(stdout) != 0) throw Error(ErrorCode::kFailed, "cannot write to stdout");
    return status;
  } catch (const Error& error) {
    return report_error(error, *command.common);
  } catch (const std::bad_alloc&) {
    return report_error(Error(ErrorCode::kFailed, kOutOfMemory), *command.common);
  } catch (const std::exception& error) {
    return report_error(Error(ErrorCode::kFailed, error.what()), *command.common);
  }
}

// CLI11 would only say that a subcommand is required. True when it was told here that there is none of this name.
bool is_unknown_word(const std::string& word, std::span<const Command> commands) {
  if (word.starts_with('-')) return false;
  std::string names;
  for (const Command& command : commands) {
    if (command.app->get_name() == word) return false;
    names += " " + command.app->get_name();
  }
  std::fprintf(stderr, "btms: unknown subcommand `%s`; there are:%s\n", word.c_str(), names.c_str());
  return true;
}

// What a pass frees, the next one takes again: giving it back to the system would only mean to fault it in anew. (Under
// a memory budget the engine's pager gives back what is free.)
void keep_freed_memory() {
  constexpr int kLargestPooled_bytes = 32 << 20, kNever_bytes = 1 << 30;
  mallopt(M_MMAP_THRESHOLD, kLargestPooled_bytes);
  mallopt(M_TRIM_THRESHOLD, kNever_bytes);
}

int parse_and_run(int argc, char** argv) {
  CLI::App app(kDescription, "btms");
  app.footer(kMainFooter);
  app.set_version_flag("--version", "btms " BTMS_VERSION "\n" BTMS_LIBRARIES);
  app.require_subcommand(1);
  app.get_formatter()->column_width(36);
  app.option_defaults()->always_capture_default();
  const Command commands[] = {add_build(app),      add_join(app),  add_label(app),  add_segment(app),   add_info(app),
                              add_query(app),      add_route(app), add_export(app), add_digest(app),    add_verify(app),
                              add_diff(app),       add_eval(app),  add_params(app), add_sweep(app),     add_synth(app),
                              add_accumulate(app), add_serve(app), add_man(app),    add_completion(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (argc > 1 && is_unknown_word(argv[1], commands)) return exit_status(ErrorCode::kUsage);
    return app.exit(error) == 0 ? 0 : exit_status(ErrorCode::kUsage);
  }
  for (const Command& command : commands)
    if (command.app->parsed()) return run(command);
  return exit_status(ErrorCode::kUsage);
}

}  // namespace
}  // namespace btms

int main(int argc, char** argv) {
  btms::keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of its write
  btms::ProcessGroup group(&argc, &argv);
  try {
    return group.end(btms::parse_and_run(argc, argv));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "btms: error: %s\n", btms::kOutOfMemory);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "btms: error: %s\n", error.what());
  }
  return group.end(btms::exit_status(btms::ErrorCode::kFailed));
}
