// consumer MAP X Y: labels a scan it makes up, and prints the height of the map at a place.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/error.h"
#include "engine/query/terrain.h"
#include "engine/tiling/scan_segmenter.h"
#include "io/client/server_url.h"
#include "io/store/open_terrain.h"
#include "robotics/point_cloud2.h"

namespace {

// Level ground of 40 m x 40 m with a box of 4 m x 4 m x 2 m on it.
void label_a_scan() {
  std::vector<float> xyz;
  for (int row = 0; row < 200; ++row)
    for (int column = 0; column < 200; ++column) {
      const float x = 0.2F * static_cast<float>(column) - 20, y = 0.2F * static_cast<float>(row) - 20;
      const bool box = x > 8 && x < 12 && y > 8 && y < 12;
      xyz.insert(xyz.end(), {x, y, box ? 2.0F : 0.0F});
    }
  btms::ScanSegmenter segmenter(btms::preset("single-scan"));
  const std::size_t points = xyz.size() / 3;
  std::size_t ground = 0;
  for (const btms::Label label : segmenter.segment(btms::interleaved(xyz.data(), points, 3)))
    ground += label == btms::Label::kTerrain;
  std::printf("ground %zu of %zu\n", ground, points);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  try {
    label_a_scan();
    const auto opened = btms::open_terrain(argv[1], {});
    const btms::HeightAnswer here = opened.terrain.height({std::atof(argv[2]), std::atof(argv[3])});
    std::printf("height %.3f %s\n", here.z_m, btms::query_status_name(here.status));
    return 0;
  } catch (const btms::Error& error) {
    std::fprintf(stderr, "consumer: %s\n", error.what());
    return btms::exit_status(error.code());
  }
}
