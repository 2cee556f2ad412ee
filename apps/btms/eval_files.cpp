#include "apps/btms/eval_files.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "engine/error.h"
#include "io/points/point_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kLasGround = 2, kKittiTerrain = 40, kKittiDropped = 0;

bool has_classes(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".las" || extension == ".LAS" || extension == ".label" || extension == ".labels";
}

// Of a folder, or the one file itself.
std::map<std::string, fs::path> files_by_stem(const fs::path& folder) {
  if (!fs::is_directory(folder)) return {{folder.stem().string(), folder}};
  std::map<std::string, fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && has_classes(entry.path())) files.emplace(entry.path().stem().string(), entry.path());
  return files;
}

void require(const fs::path& path, const char* option) {
  if (!fs::exists(path))
    throw Error(ErrorCode::kUsage, fmt::format("{}: there is no such file or folder", option), path.string());
}

// The point file with the heights of a truth file.
fs::path points_for(const fs::path& truth, const fs::path& points) {
  fs::path folder = points;
  if (points.empty()) {
    if (truth.extension() != ".label" && truth.extension() != ".labels") return truth;
    folder = fs::absolute(truth).parent_path().parent_path() / "velodyne";
  } else if (fs::is_regular_file(points)) {
    return points;
  }
  for (const std::string& extension : known_point_extensions())
    if (const fs::path path = folder / (truth.stem().string() + extension); fs::exists(path)) return path;
  throw Error(ErrorCode::kUsage,
              fmt::format("found no points for this truth in {}: the heights of its ambiguous classes are needed, and "
                          "places for --picture; give --points, or leave those classes out with --sensor-height 0",
                          folder.string()),
              truth.string());
}

// 1 terrain, 0 not, kNoPrediction where there is none.
constexpr std::uint8_t kNoPrediction = 2;

std::vector<std::uint8_t> read_prediction(const fs::path& path) {
  const std::vector<std::uint32_t> classes = read_classes(path);
  const std::string extension = path.extension().string();
  std::vector<std::uint8_t> terrain(classes.size());
  std::transform(classes.begin(), classes.end(), terrain.begin(), [&](std::uint32_t c) -> std::uint8_t {
    if (extension == ".labels") return c != 0;
    if (extension == ".label") return c == kKittiDropped ? kNoPrediction : c == kKittiTerrain;
    return c == kLasGround;
  });
  return terrain;
}

std::vector<float> read_z(const fs::path& path) {
  const auto file = open_points(path);
  PointBlock block;
  file->read(0, static_cast<std::size_t>(file->size()), block);
  std::vector<float> z(block.size());
  std::transform(block.z_mm.begin(), block.z_mm.end(), z.begin(),
                 [](std::int32_t mm) { return static_cast<float>(mm * 0.001); });
  return z;
}

void require_equal(std::size_t truth, std::size_t other, const EvalPair& pair, const fs::path& other_path) {
  if (truth == other) return;
  throw Error(ErrorCode::kBadInput,
              fmt::format("found {} points, expected {} as in {}", other, truth, pair.truth.string()),
              other_path.string());
}

// Of every point of one pair. `z_m` may be empty.
struct PairLabels {
  std::vector<std::uint32_t> truth;
  std::vector<std::uint8_t> terrain;
  std::vector<float> z_m;
};

PairLabels read_labels(const EvalPair& pair) {
  PairLabels labels{read_classes(pair.truth), read_prediction(pair.prediction), {}};
  require_equal(labels.truth.size(), labels.terrain.size(), pair, pair.prediction);
  if (!pair.points.empty()) {
    labels.z_m = read_z(pair.points);
    require_equal(labels.truth.size(), labels.z_m.size(), pair, pair.points);
  }
  return labels;
}

}  // namespace

std::vector<EvalPair> pair_files(const fs::path& truth, const fs::path& prediction, const fs::path& points,
                                 bool needs_points) {
  require(truth, "--truth");
  require(prediction, "--prediction");
  if (!points.empty()) require(points, "--points");
  const auto z_source = [&](const fs::path& path) { return needs_points ? points_for(path, points) : fs::path(); };
  if (!fs::is_directory(truth) && !fs::is_directory(prediction))
    return {{truth.stem().string(), truth, prediction, z_source(truth)}};

  auto predictions = files_by_stem(prediction);
  std::vector<EvalPair> pairs;
  std::size_t alone = 0;
  for (const auto& [stem, path] : files_by_stem(truth)) {
    const auto other = predictions.find(stem);
    if (other == predictions.end()) {
      ++alone;
      continue;
    }
    pairs.push_back({stem, path, other->second, z_source(path)});
    predictions.erase(other);
  }
  if (pairs.empty())
    throw Error(ErrorCode::kBadInput, fmt::format("no file of {} has the name of one in {} (.las, .label or .labels)",
                                                  truth.string(), prediction.string()));
  if (alone > 0) spdlog::warn("{} files of {} have no prediction and are left out", alone, truth.string());
  if (!predictions.empty()) spdlog::warn("{} predictions have no truth and are left out", predictions.size());
  return pairs;
}

std::vector<Verdict> verdicts(const EvalPair& pair, const TruthRules& rules) {
  const auto [truth, terrain, z_m] = read_labels(pair);
  std::vector<Verdict> verdicts(truth.size(), Verdict::kLeftOut);
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (terrain[i] != kNoPrediction)
      verdicts[i] = verdict(truth[i], terrain[i] != 0, z_m.empty() ? 0 : static_cast<double>(z_m[i]), rules);
  return verdicts;
}

EvalResult evaluate(const EvalPair& pair, const TruthRules& rules) {
  auto [truth, terrain, z] = read_labels(pair);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (terrain[i] == kNoPrediction) continue;
    truth[kept] = truth[i];
    terrain[kept] = terrain[i];
    if (!z.empty()) z[kept] = z[i];
    ++kept;
  }
  EvalResult result{.name = pair.name, .points = kept, .left_out = truth.size() - kept, .scores = {}, .classes = {}};
  truth.resize(kept);
  terrain.resize(kept);
  if (!z.empty()) z.resize(kept);
  result.scores = score(truth, terrain, z, rules);
  for (std::size_t i = 0; i < kept; ++i) {
    ClassCount& count = result.classes[truth[i]];
    ++count.points;
    count.terrain += terrain[i];
  }
  return result;
}

}  // namespace btms
