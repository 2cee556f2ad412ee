#include "apps/btms/outputs.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "engine/error.h"
#include "engine/tiling/spill.h"
#include "io/files/atomic_file.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string text = path.extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// weakly: neither need exist. Links are followed, so that no other name leads into a map.
bool lies_in(const fs::path& path, const fs::path& folder) {
  const fs::path inner = fs::weakly_canonical(path), outer = fs::weakly_canonical(folder);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

bool lies_in_a_map(const fs::path& path) {
  for (fs::path folder = fs::weakly_canonical(path).parent_path(); folder != folder.root_path();
       folder = folder.parent_path())
    if (folder.extension() == ".btms" || (fs::exists(folder / kManifest) && fs::is_directory(folder / kShardFolder)))
      return true;
  return false;
}

}  // namespace

void add_force_option(CLI::App& app, bool& force) { app.add_flag("--force", force, "Replace output files that exist"); }

void refuse_existing(std::span<const fs::path> outputs, bool force) {
  if (force) return;
  for (const fs::path& output : outputs)
    if (fs::exists(fs::symlink_status(output)))
      throw Error(ErrorCode::kUsage, "exists already; choose another output folder, or replace it with --force",
                  output.string());
}

void prepare_label_folder(const PointFiles& inputs, const fs::path& folder, bool force) {
  std::map<std::string, fs::path> seen;
  std::vector<fs::path> outputs;
  for (const auto& input : inputs) {
    // a.las and a.LAS are one file to many a system.
    const std::string name = input->path().stem().string() + lower_extension(input->path());
    const auto [other, is_new] = seen.emplace(name, input->path());
    if (!is_new)
      throw Error(ErrorCode::kUsage, fmt::format("{} and {} have the same name, so one output would replace the other; "
                                                 "give them to separate calls with different output folders",
                                                 other->second.string(), input->path().string()));
    outputs.push_back(label_path(input->path(), folder));
    std::error_code ignored;
    if (fs::equivalent(outputs.back(), input->path(), ignored))
      throw Error(ErrorCode::kUsage, "the output would replace this input; choose another output folder",
                  input->path().string());
  }
  refuse_existing(outputs, force);
  std::uint64_t bytes = 0;  // what is replaced makes room
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (!fs::exists(outputs[i])) bytes += label_bytes(*inputs[i]);
  require_disk(folder, bytes, "or choose another output folder");
  make_folders(folder);
}

void check_picture(const fs::path& picture, const fs::path& map, std::span<const fs::path> inputs) {
  const auto refuse = [&](const char* why) { throw Error(ErrorCode::kUsage, why, picture.string()); };
  if (lower_extension(picture) != ".png") refuse("--picture: expected a name that ends in .png");
  if (fs::is_directory(picture)) refuse("--picture: this is a folder");
  std::error_code ignored;
  for (const fs::path& input : inputs)
    if (fs::equivalent(picture, input, ignored)) refuse("--picture: would replace this input");
  if ((!map.empty() && lies_in(picture, map)) || lies_in_a_map(picture))
    refuse("--picture: lies inside a map; choose another folder");
  const fs::path folder = fs::absolute(picture).parent_path();
  if (!fs::is_directory(folder)) throw Error(ErrorCode::kUsage, "the picture's folder does not exist", folder.string());
}

}  // namespace btms
