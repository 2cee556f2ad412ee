// btms_pcl: the ground filters of the Point Cloud Library that Debian ships, as a program that reads and writes the
// files btms does, for the macro bench. Only with -DBTMS_WITH_PCL=ON.
#include <pcl/point_types.h>
#include <pcl/segmentation/approximate_progressive_morphological_filter.h>
#include <pcl/segmentation/sac_segmentation.h>
#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <nlohmann/json.hpp>

#include "io/points/point_file.h"

namespace btms::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Files = std::vector<std::unique_ptr<PointFile>>;

struct Options {
  std::vector<std::string> inputs;
  std::string output;
  int threads = 1;
  float cell_m = 0.7f, slope = 0.3f, initial_m = 0.4f, most_m = 5;
  int window = 65, base = 2;
  bool linear = false;
  float thickness_m = 4;  // ransac
};

double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// Relative to the first point, in the filter's floats.
Cloud::Ptr read_cloud(const Files& files) {
  auto cloud = std::make_shared<Cloud>();
  std::uint64_t points = 0;
  for (const auto& file : files) points += file->size();
  cloud->reserve(points);
  constexpr std::uint64_t kBlock = 1 << 16;
  PointBlock block;
  std::optional<std::array<std::int64_t, 2>> origin_mm;
  for (const auto& file : files)
    for (std::uint64_t first = 0; first < file->size(); first += kBlock) {
      file->read(first, static_cast<std::size_t>(std::min(kBlock, file->size() - first)), block);
      if (block.dropped() > 0) throw std::runtime_error("the peers take no files with points that are not finite");
      if (!origin_mm) origin_mm = {block.x_mm[0], block.y_mm[0]};
      for (std::size_t i = 0; i < block.size(); ++i)
        cloud->push_back({static_cast<float>(block.x_mm[i] - (*origin_mm)[0]) / 1000,
                          static_cast<float>(block.y_mm[i] - (*origin_mm)[1]) / 1000,
                          static_cast<float>(block.z_mm[i]) / 1000});
    }
  return cloud;
}

pcl::Indices morphological(const Cloud::Ptr& cloud, const Options& o) {
  pcl::ApproximateProgressiveMorphologicalFilter<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setCellSize(o.cell_m);
  filter.setSlope(o.slope);
  filter.setInitialDistance(o.initial_m);
  filter.setMaxDistance(o.most_m);
  filter.setMaxWindowSize(o.window);
  filter.setBase(static_cast<float>(o.base));
  filter.setExponential(!o.linear);
  filter.setNumberOfThreads(static_cast<unsigned>(o.threads));
  pcl::Indices ground;
  filter.extract(ground);
  return ground;
}

pcl::Indices plane(const Cloud::Ptr& cloud, const Options& o) {
  pcl::SACSegmentation<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setModelType(pcl::SACMODEL_PLANE);
  filter.setMethodType(pcl::SAC_RANSAC);
  filter.setDistanceThreshold(o.thickness_m);
  filter.setNumberOfThreads(o.threads);
  pcl::ModelCoefficients coefficients;
  pcl::PointIndices ground;
  filter.segment(ground, coefficients);
  return ground.indices;
}

void write_labels(const Files& files, const pcl::Indices& ground, const std::string& folder) {
  std::uint64_t points = 0;
  for (const auto& file : files) points += file->size();
  std::vector<Label> labels(points, Label::kObstacle);
  for (const pcl::index_t i : ground) labels[static_cast<std::size_t>(i)] = Label::kTerrain;
  std::uint64_t first = 0;
  for (const auto& file : files) {
    const auto writer = create_labels(*file, folder);
    writer->write(0, std::span(labels).subspan(first, file->size()));
    writer->commit();
    first += file->size();
  }
}

template <class Filter>
void run(const Options& options, Filter filter) {
  Files files;
  for (const auto& path : expand_inputs(options.inputs).paths) files.push_back(open_points(path));
  const auto begun = std::chrono::steady_clock::now();
  const Cloud::Ptr cloud = read_cloud(files);
  const double read_s = seconds_since(begun);
  const auto filter_begun = std::chrono::steady_clock::now();
  const pcl::Indices ground = filter(cloud, options);
  const double filter_s = seconds_since(filter_begun);
  write_labels(files, ground, options.output);
  fmt::print("{}\n", nlohmann::ordered_json{{"points", cloud->size()},
                                            {"ground", ground.size()},
                                            {"read_seconds", read_s},
                                            {"filter_seconds", filter_s},
                                            {"seconds", seconds_since(begun)}}
                         .dump());
}

}  // namespace
}  // namespace btms::bench

int main(int argc, char** argv) {
  using namespace btms::bench;
  Options options;
  CLI::App app("PCL's ground filters on the files of btms", "btms_pcl");
  app.option_defaults()->always_capture_default();
  app.require_subcommand(1);
  CLI::App* pmf = app.add_subcommand("pmf", "Approximate progressive morphological filter");
  CLI::App* ransac = app.add_subcommand("ransac", "The plane with the most points");
  for (CLI::App* method : {pmf, ransac}) {
    method->add_option("INPUT", options.inputs, "Point files")->required();
    method->add_option("-o,--output", options.output, "An existing folder for the labelled files")->required();
    method->add_option("--threads", options.threads, "Threads of the filter");
  }
  pmf->add_option("--cell", options.cell_m, "Cell size, m");
  pmf->add_option("--slope", options.slope, "Slope of the terrain, rise over run");
  pmf->add_option("--initial", options.initial_m, "First height threshold, m");
  pmf->add_option("--most", options.most_m, "Largest height threshold, m");
  pmf->add_option("--window", options.window, "Largest window, cells");
  pmf->add_option("--base", options.base, "Base of the windows' growth");
  pmf->add_flag("--linear", options.linear, "Windows grow by addition, not by multiplication");
  ransac->add_option("--thickness", options.thickness_m, "Largest distance from the plane, m");
  CLI11_PARSE(app, argc, argv);
  try {
    pmf->parsed() ? run(options, morphological) : run(options, plane);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "btms_pcl: {}\n", error.what());
    return 1;
  }
}
