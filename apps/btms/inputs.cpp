#include "apps/btms/inputs.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <map>

#include "engine/error.h"
#include "io/store/crs.h"

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

std::string lower_extension(const fs::path& path) {
  std::string text = path.extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

PointFiles open_all(std::span<const fs::path> paths) {
  allow_open_files(paths.size());
  PointFiles files;
  for (const fs::path& path : paths) files.push_back(open_points(path));
  return files;
}

void log_warnings(const PointFiles& files) {
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

void prepare_output_folder(const PointFiles& inputs, const fs::path& folder) {
  std::map<std::string, fs::path> seen;
  for (const auto& input : inputs) {
    const std::string name = input->path().stem().string() + lower_extension(input->path());
    const auto [other, is_new] = seen.emplace(name, input->path());
    if (!is_new)
      throw Error(ErrorCode::kUsage, fmt::format("{} and {} have the same name, so one output would replace the other; "
                                                 "give them to separate calls with different output folders",
                                                 other->second.string(), input->path().string()));
    std::error_code ignored;
    if (fs::equivalent(folder / input->path().filename(), input->path(), ignored))
      throw Error(ErrorCode::kUsage, "the output would replace this input; choose another output folder",
                  input->path().string());
  }
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorCode::kFailed, "cannot make the output folder: " + error.message(), folder.string());
}

std::string metric_crs(const std::string& text) {
  if (text.empty()) return {};
  const Crs crs = describe_crs(text);
  if (crs.is_geographic || crs.linear_unit_m != 1)
    throw Error(ErrorCode::kUsage,
                fmt::format("--crs {}: its unit is not the metre, but the map's coordinates are metres; "
                            "name a projected system in metres",
                            text));
  return crs.wkt;
}

std::string agreed_crs(const PointFiles& files, const std::string& wanted) {
  if (!wanted.empty()) return metric_crs(wanted);
  std::map<std::string, std::string> normalised;  // tiles of one survey repeat the same text
  const auto normalise = [&](const PointFile& file) -> const std::string& {
    const auto [entry, is_new] = normalised.try_emplace(file.info().crs);
    if (is_new) {
      try {
        entry->second = normalise_crs(file.info().crs);
      } catch (const Error& error) {
        spdlog::warn("{}: its coordinate reference system is left out: {}", file.name(), error.what());
      }
    }
    return entry->second;
  };
  const PointFile* named = nullptr;
  const PointFile* unnamed = nullptr;
  std::string crs;
  for (const auto& file : files) {
    const std::string& text = normalise(*file);
    if (text.empty()) {
      unnamed = file.get();
    } else if (named == nullptr) {
      named = file.get();
      crs = text;
    } else if (text != crs) {
      throw Error(
          ErrorCode::kBadInput,
          fmt::format("{} and {} are in different coordinate reference systems; convert one of them, or say with "
                      "--crs EPSG:n which one holds for all",
                      named->name(), file->name()));
    }
  }
  if (named != nullptr && unnamed != nullptr)
    spdlog::warn("{} names no coordinate reference system; taken to be in that of {}", unnamed->name(), named->name());
  return crs;
}

}  // namespace btms
