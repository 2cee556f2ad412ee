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

// What a control group may still take.
std::uint64_t left_in_group(const fs::path& limit_file, const fs::path& used_file) {
  const std::uint64_t limit = number_in(limit_file), used = number_in(used_file);
  if (limit == UINT64_MAX || used == UINT64_MAX) return limit;
  return limit > used ? limit - used : 0;
}

}  // namespace

std::uint64_t available_memory_bytes() {
  std::uint64_t available = UINT64_MAX;
  std::ifstream meminfo("/proc/meminfo");
  for (std::string name, rest; meminfo >> name; std::getline(meminfo, rest))
    if (name == "MemAvailable:")
      if (std::uint64_t kib = 0; meminfo >> kib) available = kib * 1024;
  return std::min(
      {available, left_in_group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
       left_in_group("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes")});
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
