#include "apps/btms/inputs.h"

#include <spdlog/spdlog.h>

namespace btms {
namespace fs = std::filesystem;

PointFiles open_all(std::span<const fs::path> paths, const PointFileOptions& options) {
  PointFiles files;
  for (const fs::path& path : paths) files.push_back(open_points(path, options));
  return files;
}

void add_columns_option(CLI::App& app, PointFileOptions& options) {
  app.add_option("--columns", options.columns,
                 "Of text files: where x, y and z are (2,3,4), or what the columns are (id,x,y,z) (default: as the "
                 "line above the points says, else the first three)")
      ->type_name("LIST")
      ->default_str("");
}

void log_warnings(const InputList& list, const PointFiles& files) {
  log_warnings(list);
  for (const auto& file : files) log_warnings(*file);
}

void log_warnings(const InputList& list) {
  for (const std::string& warning : list.warnings) spdlog::warn("{}", warning);
}

void log_warnings(const PointFile& file) {
  for (const std::string& warning : file.info().warnings) spdlog::warn("{}: {}", file.name(), warning);
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
