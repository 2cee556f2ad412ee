#include "apps/btms/memory_option.h"

#include <algorithm>
#include <fstream>

#include "engine/error.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLeast_bytes = std::uint64_t{128} << 20;

std::uint64_t number_in(const fs::path& file) {
  std::ifstream in(file);
  std::uint64_t value = UINT64_MAX;
  return in >> value ? value : UINT64_MAX;
}

}  // namespace

std::uint64_t available_memory_bytes() {
  std::uint64_t available = UINT64_MAX;
  std::ifstream meminfo("/proc/meminfo");
  for (std::string name, rest; meminfo >> name; std::getline(meminfo, rest))
    if (name == "MemAvailable:")
      if (std::uint64_t kib = 0; meminfo >> kib) available = kib * 1024;
  const std::uint64_t limit =
      std::min(number_in("/sys/fs/cgroup/memory.max"), number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
  return std::min(available, limit);
}

void MemoryOption::add_to(CLI::App& app, bool with_spill) {
  app.add_option("--memory", bytes,
                 std::string("Memory to use, at least 128M (default: three quarters of what is free)") +
                     (with_spill ? "; what doesn't fit is parked on disk" : ""))
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(kLeast_bytes, std::uint64_t{1} << 50))
      ->default_str("")
      ->type_name("SIZE")
      ->group("Running");
  if (with_spill)
    app.add_option("--spill", spill, "Folder for scratch files (default: the one the output is in)")
        ->type_name("DIR")
        ->default_str("")
        ->group("Running");
}

std::uint64_t MemoryOption::limit() const {
  if (bytes > 0) return bytes;
  const std::uint64_t free = available_memory_bytes();
  return free == UINT64_MAX ? free : std::max(kLeast_bytes, free / 4 * 3);
}

fs::path MemoryOption::spill_folder(const fs::path& output) const {
  if (!spill.empty()) {
    if (!fs::is_directory(spill)) throw Error(ErrorCode::kUsage, "--spill: expected a folder that exists", spill);
    return spill;
  }
  const fs::path parent = fs::absolute(output).lexically_normal().parent_path();
  return fs::is_directory(parent) ? parent : fs::current_path();
}

}  // namespace btms
