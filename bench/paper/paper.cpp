// btms_paper: the paper's table of results, single scans and partial maps, on the files given.
//
//   btms_paper --scans sequences/00/velodyne --labels sequences/00/labels --maps map.las
//
// Every cloud is segmented alone, in memory, by one thread; times are that thread's CPU time, without file access,
// after one run to warm up. docs/paper_tables.md says what is compared with what.
#include <spdlog/fmt/fmt.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>

#include "bench/paper/gpf.h"
#include "bench/paper/ransac.h"
#include "bench/paper/table.h"
#include "engine/tiling/block_source.h"
#include "engine/tiling/scan_segmenter.h"
#include "io/files/atomic_file.h"
#include "io/points/point_file.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

// Finite points with their classes, in memory.
struct Cloud {
  PointBlock block;
  std::vector<Eigen::Vector3f> metres;  // near the origin: floats hold them
  std::vector<float> z_m;
  std::vector<std::uint32_t> truth;
};

Cloud read_cloud(const fs::path& points, const fs::path& classes) {
  const auto file = open_points(points);
  PointBlock all;
  file->read(0, static_cast<std::size_t>(file->size()), all);
  const std::vector<std::uint32_t> truth = read_classes(classes);
  if (truth.size() != all.size())
    throw std::runtime_error(
        fmt::format("{} has {} classes, {} {} points", classes.string(), truth.size(), points.string(), all.size()));
  Cloud cloud;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all.x_mm[i] == PointBlock::kDroppedX) continue;
    cloud.block.x_mm.push_back(all.x_mm[i]);
    cloud.block.y_mm.push_back(all.y_mm[i]);
    cloud.block.z_mm.push_back(all.z_mm[i]);
    cloud.truth.push_back(truth[i]);
  }
  constexpr std::int64_t kKilometre_mm = 1'000'000;
  const auto metres = [](std::int64_t mm) { return static_cast<float>(static_cast<double>(mm) / 1000); };
  for (std::size_t i = 0; i < cloud.block.size(); ++i) {
    const PointBlock& b = cloud.block;
    const std::int64_t x0 = b.x_mm[0] / kKilometre_mm * kKilometre_mm, y0 = b.y_mm[0] / kKilometre_mm * kKilometre_mm;
    cloud.metres.emplace_back(metres(b.x_mm[i] - x0), metres(b.y_mm[i] - y0), metres(b.z_mm[i]));
    cloud.z_m.push_back(metres(b.z_mm[i]));
  }
  return cloud;
}

// What is terrain in a cloud. A method keeps its memory from cloud to cloud.
using Segment = std::function<std::vector<std::uint8_t>(const Cloud&)>;
struct Method {
  std::string name;
  Segment segment;
};

Method of_parameters(std::string name, const Parameters& parameters) {
  const auto segmenter = std::make_shared<ScanSegmenter>(parameters);
  return {std::move(name), [segmenter](const Cloud& cloud) {
            std::vector<std::uint8_t> terrain;
            for (const Label label : segmenter->segment(BlockSource(cloud.block)))
              terrain.push_back(label == Label::kTerrain);
            return terrain;
          }};
}

// `kind` ends the names of the presets: "single-scan", "partial-map".
std::vector<Method> methods(const std::string& kind, double sensor_height_m) {
  GpfParameters gpf;
  gpf.sensor_height_m = sensor_height_m;
  const Parameters paper = preset("paper-" + kind);
  Parameters predecessor = paper;
  predecessor.completion = Completion::kNone;
  predecessor.node_weight = NodeWeight::kPredecessor;
  return {{"RANSAC", [](const Cloud& cloud) { return ransac_ground(cloud.metres); }},
          {"GPF", [gpf](const Cloud& cloud) { return gpf_ground(cloud.metres, gpf); }},
          of_parameters("predecessor's mode", predecessor),
          of_parameters("B-TMS, Table I", paper),
          of_parameters("B-TMS, `" + kind + "`", preset(kind))};
}

double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct CloudFiles {
  fs::path points, classes;
};

// One cloud in memory at a time.
PaperBlock run_block(std::string title, const std::vector<CloudFiles>& files, const TruthRules& rules,
                     const std::string& kind) {
  PaperBlock block{std::move(title), {}};
  const std::vector<Method> all = methods(kind, rules.sensor_height_m);
  for (const Method& method : all) block.rows.push_back({method.name, {}, {}});
  for (const CloudFiles& file : files) {
    const Cloud cloud = read_cloud(file.points, file.classes);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (block.rows[i].clouds.empty()) all[i].segment(cloud);  // warms up
      const double begun = thread_seconds();
      const std::vector<std::uint8_t> terrain = all[i].segment(cloud);
      block.rows[i].seconds.push_back(thread_seconds() - begun);
      block.rows[i].clouds.push_back(score(cloud.truth, terrain, cloud.z_m, rules));
    }
  }
  return block;
}

std::vector<CloudFiles> scans_with_labels(const std::vector<std::string>& scans, const fs::path& labels) {
  std::vector<CloudFiles> files;
  for (const fs::path& path : expand_inputs(scans).paths)
    files.push_back({path, labels / path.filename().replace_extension(".label")});
  return files;
}

int run(int argc, char** argv) {
  CLI::App app(
      "The paper's table: precision, recall, F1 and accuracy of ground segmentation, with and without the "
      "ambiguous classes, and time per cloud");
  std::vector<std::string> scans, maps;
  std::string labels, json, scan_map = "kitti", map_map = "partial-map", title;
  app.add_option("--scans", scans, "Single scans: .bin files, or a folder of them");
  app.add_option("--labels", labels, "Folder with a .label for each")->needs("--scans");
  app.add_option("--label-map", scan_map, "Of the scans: kitti or rellis")
      ->check(CLI::IsMember(label_map_names()))
      ->capture_default_str();
  app.add_option("--maps", maps, "Partial maps: classified .las files as `btms accumulate` writes them");
  app.add_option("--maps-label-map", map_map, "Of the maps")
      ->check(CLI::IsMember(label_map_names()))
      ->capture_default_str();
  app.add_option("--json", json, "Also write the figures to this file");
  CLI11_PARSE(app, argc, argv);
  if (!scans.empty() && labels.empty()) throw std::runtime_error("--scans: give their --labels, too");
  if (scans.empty() && maps.empty()) throw std::runtime_error("give --scans with --labels, --maps, or both");

  std::vector<PaperBlock> blocks;
  if (!scans.empty()) {
    const auto files = scans_with_labels(scans, labels);
    blocks.push_back(
        run_block(fmt::format("single scans ({})", files.size()), files, rules_of_label_map(scan_map), "single-scan"));
  }
  if (!maps.empty()) {
    std::vector<CloudFiles> files;
    for (const fs::path& path : expand_inputs(maps).paths) files.push_back({path, path});
    blocks.push_back(
        run_block(fmt::format("partial maps ({})", files.size()), files, rules_of_label_map(map_map), "partial-map"));
  }
  for (const PaperBlock& block : blocks) print_block(block);
  if (!json.empty()) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const PaperBlock& block : blocks) all.push_back(to_json(block));
    write_file(json, all.dump(2) + "\n");
  }
  return 0;
}

}  // namespace
}  // namespace btms::bench

int main(int argc, char** argv) {
  try {
    return btms::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "btms_paper: %s\n", error.what());
    return 1;
  }
}
