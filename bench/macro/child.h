// Runs a program as a child process and says what it cost: nothing of the bench itself is in the figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace btms::bench {

struct Cost {
  double wall_s = 0, user_s = 0, system_s = 0;
  std::uint64_t peak_rss_bytes = 0;
  // Through read() and write() calls, whether or not a disk was behind them; 0 where the kernel doesn't count.
  std::uint64_t read_bytes = 0, written_bytes = 0;
};

struct ChildRun {
  Cost cost;
  std::string output;  // stdout; stderr is the bench's own
};

// peak_rss_bytes is never below what this process itself held at its most: keep it small.
// Throws std::runtime_error when the program cannot be started or does not end with status 0.
ChildRun run_child(const std::vector<std::string>& command);

}  // namespace btms::bench
