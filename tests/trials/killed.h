// A program that is killed at a random moment.
#pragma once

#include <chrono>
#include <map>
#include <thread>

#include "engine/error.h"
#include "tests/cli/program.h"
#include "tests/support/cloud.h"

namespace btms::test {

inline double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// Kills it after this long. The phase it was in by its progress lines; empty when it had ended before.
inline std::string kill_after(Running& program, double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  if (program.has_ended()) return {};
  const std::string said = program.err_so_far();
  program.send(SIGKILL);
  if (program.wait().status != 128 + SIGKILL) return {};
  // "{"phase":"fit",...}" a line
  std::string phase = "start";
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (json.is_object() && json.contains("phase")) phase = json["phase"];
  }
  return phase;
}

// Runs it to the end; of ranks that were killed others may be there for a moment still, and hold the lock.
inline Outcome run_when_unlocked(const std::vector<std::string>& arguments) {
  for (int attempt = 0;; ++attempt) {
    Outcome outcome = run(arguments);
    if (outcome.status == 0 || attempt == 50 || outcome.err.find("another build is writing") == std::string::npos)
      return outcome;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

inline Outcome succeed(const std::vector<std::string>& arguments) {
  Outcome outcome = run_when_unlocked(arguments);
  if (outcome.status != 0) throw Error(ErrorCode::kFailed, arguments[0] + " failed: " + outcome.err);
  return outcome;
}

inline std::string counted_phases(const std::map<std::string, int>& phases) {
  std::string text;
  for (const auto& [phase, n] : phases) text += (text.empty() ? "" : ", ") + phase + " " + std::to_string(n);
  return text;
}

}  // namespace btms::test
