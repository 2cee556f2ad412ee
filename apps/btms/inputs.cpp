#include "apps/btms/inputs.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>

namespace btms {
namespace {

namespace fs = std::filesystem;

void allow_open_files(std::size_t wanted) {
  constexpr std::size_t kOthers = 64;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted + kOthers) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, wanted + kOthers);
  setrlimit(RLIMIT_NOFILE, &limit);  // when it fails, open() says so
}

}  // namespace

PointFiles open_all(std::span<const fs::path> paths) {
  allow_open_files(paths.size());
  PointFiles files;
  for (const fs::path& path : paths) files.push_back(open_points(path));
  return files;
}

void log_warnings(const InputList& list, const PointFiles& files) {
  for (const std::string& warning : list.warnings) spdlog::warn("{}", warning);
  for (const auto& file : files)
    for (const std::string& warning : file->info().warnings) spdlog::warn("{}: {}", file->name(), warning);
}

Json input_json(const PointFile& file) {
  return {{"path", file.path().string()},
          {"format", file.info().format},
          {"points", file.info().points},
          {"bytes", file.info().bytes},
          {"warnings", file.info().warnings}};
}

std::uint64_t total_points(const PointFiles& files) {
  std::uint64_t total = 0;
  for (const auto& file : files) total += file->size();
  return total;
}

}  // namespace btms
