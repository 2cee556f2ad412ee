// --memory and --spill, of the subcommands that can work on more than memory holds.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>

namespace btms {

struct MemoryOption {
  std::uint64_t bytes = 0;  // 0: three quarters of what is free
  std::string spill;        // empty: beside the output

  void add_to(CLI::App& app, bool with_spill);
  // What the run may take.
  std::uint64_t limit() const;
  // Where scratch files go; `output` is what the run writes.
  std::filesystem::path spill_folder(const std::filesystem::path& output) const;
};

// Memory that processes can have without swapping, bounded by the control group's limit. UINT64_MAX when the system
// doesn't tell.
std::uint64_t available_memory_bytes();

}  // namespace btms
