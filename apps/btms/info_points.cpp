#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "apps/btms/info.h"
#include "apps/btms/inputs.h"
#include "apps/btms/reference_system.h"

namespace btms {
namespace {

using Bounds = std::array<double, 6>;  // min x, y, z, max x, y, z

struct Extent {
  std::optional<Bounds> bounds_m;
  std::uint64_t points = 0, square_metres = 0;  // squares of 1 m x 1 m with a point
};

// How many different ones there are, in at most 16 bytes each.
class Squares {
 public:
  void add(std::int64_t square) {
    if (all_.size() >= kMost || (!all_.empty() && all_.back() == square)) return;
    all_.push_back(square);
    if (all_.size() >= wanted_) {
      tidy_up();
      wanted_ = std::max(wanted_, 2 * all_.size());
    }
  }
  // 0 when there are too many to tell.
  std::uint64_t count() {
    tidy_up();
    return all_.size() < kMost ? all_.size() : 0;
  }

 private:
  void tidy_up() {
    std::sort(all_.begin(), all_.end());
    all_.erase(std::unique(all_.begin(), all_.end()), all_.end());
  }
  static constexpr std::size_t kMost = std::size_t{1} << 26;  // no information is worth gigabytes
  std::vector<std::int64_t> all_;
  std::size_t wanted_ = 1 << 16;
};

// One pass over the points, block by block.
Extent measure(const PointFile& file) {
  constexpr std::uint64_t kBlock = 1 << 16;
  constexpr std::int64_t kMetre_mm = 1000;
  Extent extent;
  Squares squares;
  std::array<std::int64_t, 3> low{}, high{};
  PointBlock block;
  for (std::uint64_t first = 0; first < file.size(); first += kBlock) {
    file.read(first, static_cast<std::size_t>(std::min(kBlock, file.size() - first)), block);
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (block.x_mm[i] == PointBlock::kDroppedX) continue;
      const std::array<std::int64_t, 3> p{block.x_mm[i], block.y_mm[i], block.z_mm[i]};
      if (extent.points++ == 0) low = high = p;
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], p[a]);
        high[a] = std::max(high[a], p[a]);
      }
      squares.add((floor_div(p[1], kMetre_mm) << 32) ^ (floor_div(p[0], kMetre_mm) & 0xffffffff));
    }
  }
  if (extent.points == 0) return extent;
  extent.bounds_m.emplace();
  for (std::size_t a = 0; a < 3; ++a) {
    (*extent.bounds_m)[a] = static_cast<double>(low[a]) / 1000;
    (*extent.bounds_m)[a + 3] = static_cast<double>(high[a]) / 1000;
  }
  extent.square_metres = squares.count();
  return extent;
}

// Points per square metre, and of which area; 0 when it can't be told.
double density(const PointFileInfo& info, const Extent& extent) {
  if (extent.square_metres > 0) return static_cast<double>(extent.points) / static_cast<double>(extent.square_metres);
  if (!info.declared_bounds_m) return 0;
  const Bounds& b = *info.declared_bounds_m;
  const double area = (b[3] - b[0]) * (b[4] - b[1]);
  return area > 0 ? static_cast<double>(info.points) / area : 0;
}

}  // namespace

void print_point_file(const std::string& path, const PointFileOptions& options, bool as_json) {
  const auto file = open_points(path, options);
  const PointFileInfo& info = file->info();
  const bool declared = info.declared_bounds_m.has_value();
  const Extent extent = declared ? Extent{} : measure(*file);
  const double per_m2 = density(info, extent);
  if (as_json) {
    Json json{{"kind", "points"}};
    json.update(input_json(*file));
    json["crs"] = info.crs;
    if (declared) json["declared_bounds_m"] = *info.declared_bounds_m;
    if (extent.bounds_m) json["bounds_m"] = *extent.bounds_m;
    if (per_m2 > 0) json["points_per_m2"] = tidy(per_m2);
    return print_json(json);
  }
  TextTable table(TextTable::Align::kLeft);
  table.row({"format", info.format});
  table.row({"points", grouped(info.points)});
  table.row({"size", bytes_text(info.bytes)});
  if (const auto& b = declared ? info.declared_bounds_m : extent.bounds_m) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (std::size_t a = 0; a < 3; ++a)
      table.row(
          {kAxes[a], fmt::format("{:.3f} to {:.3f} m{}", (*b)[a], (*b)[a + 3], declared ? ", says the header" : "")});
  }
  if (per_m2 > 0)
    table.row({"density", fmt::format("{:.2f} points/m2 of {}", per_m2,
                                      declared ? "the header's box" : "the squares of 1 m with points")});
  table.row({"crs", crs_title(info.crs)});
  for (const std::string& warning : info.warnings) table.row({"warning", warning});
  table.print();
}

}  // namespace btms
