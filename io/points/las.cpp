#include "io/points/las.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/crs/crs_units.h"
#include "io/crs/reprojection.h"
#include "io/points/las_crs.h"
#include "io/points/las_header.h"
#include "io/points/las_scaling.h"
#include "io/points/las_unpack.h"
#include "io/points/metres.h"
#include "io/points/records.h"

namespace btms {
namespace {

class LasFile final : public PointFile {
 public:
  LasFile(const std::filesystem::path& path, const std::string& crs)
      : PointFile(path),
        header_(read_las_header(file_)),
        crs_(read_las_crs(file_, header_)),
        scaling_(times_unit(header_.scale, 1000), times_unit(header_.offset, 1000)) {
    info_.format =
        "LAS 1." + std::to_string(header_.minor_version) + ", point format " + std::to_string(header_.format);
    info_.points = header_.points;
    info_.declared_bounds_m = header_.declared_bounds;
    if (info_.declared_bounds_m)
      for (std::size_t i = 0; i < 6; ++i)
        (*info_.declared_bounds_m)[i] *= i % 3 == 2 ? crs_.vertical_m : crs_.horizontal_m;
    if (header_.declared_bounds) box_ = units_of(*header_.declared_bounds);
    info_.crs = crs_.text;
    info_.warnings = header_.warnings;
    info_.warnings.insert(info_.warnings.end(), crs_.warnings.begin(), crs_.warnings.end());
    move_to(crs);
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    read_records(file_, {header_.points_offset, header_.record_bytes}, first, count, block,
                 [&](const std::uint8_t* records, std::size_t n, std::size_t at) { unpack(records, n, block, at); });
  }

  // What the file's coordinates have to become, where they don't stay what they are.
  void move_to(const std::string& wanted) {
    if (header_.declared_bounds && !can_be(crs_.kind, middle_of(*header_.declared_bounds))) {
      info_.warnings.push_back(std::string("coordinates are said to be ") +
                               (crs_.kind == LasCrs::Kind::kDegrees ? "in degrees" : "geocentric") +
                               ", but are nowhere on Earth then: taken to be metres in a system that is not named");
      crs_.kind = LasCrs::Kind::kPlane;
      info_.crs = crs_.text = "";
    }
    const bool plane = crs_.kind == LasCrs::Kind::kPlane;
    if (plane && (wanted.empty() || crs_.text.empty() || same_horizontal_crs(crs_.text, wanted))) return;
    info_.crs = plane ? with_heights_of(wanted, crs_.text) : wanted;
    if (wanted.empty()) {
      const char* kind = crs_.kind == LasCrs::Kind::kDegrees ? "in degrees" : "geocentric";
      if (header_.declared_bounds) info_.crs = utm_of(crs_.text, middle_of(*header_.declared_bounds));
      if (info_.crs.empty())
        file_.refuse(std::string("coordinates are ") + kind +
                     ", and the box in its header lies in no UTM zone; say with --to-crs EPSG:n where to put them");
      info_.warnings.push_back(std::string("coordinates are ") + kind + ": projected to the UTM zone they are in");
    }
    reprojection_ = reprojection(crs_.text, info_.crs);
    info_.declared_bounds_m.reset();
  }
  // Some writers declare what they don't write.
  static bool can_be(LasCrs::Kind kind, const std::array<double, 3>& place) {
    switch (kind) {
      case LasCrs::Kind::kDegrees:
        return std::abs(place[0]) <= 360 && std::abs(place[1]) <= 90;
      case LasCrs::Kind::kGeocentric:
        return std::abs(std::hypot(place[0], place[1], place[2]) - 6.37e6) < 1e5;
      case LasCrs::Kind::kPlane:
        break;
    }
    return true;
  }
  static std::array<double, 3> middle_of(const std::array<double, 6>& box) {
    return {(box[0] + box[3]) / 2, (box[1] + box[4]) / 2, (box[2] + box[5]) / 2};
  }

  std::array<double, 3> times_unit(const std::array<double, 3>& xyz, double mm) const {
    return {xyz[0] * (mm * crs_.horizontal_m), xyz[1] * (mm * crs_.horizontal_m), xyz[2] * (mm * crs_.vertical_m)};
  }

  // In the file's integers; wider than any of them where the box is.
  struct Box {
    std::array<std::int32_t, 3> low, high;
  };
  Box units_of(const std::array<double, 6>& bounds) const {
    constexpr double kRounded = 0.011;  // file units: some writers round the box to its second decimal
    constexpr double kLeast = std::numeric_limits<std::int32_t>::min(),
                     kMost = std::numeric_limits<std::int32_t>::max();
    Box box{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto unit = [&](double v) {
        return std::clamp((v - header_.offset[axis]) / header_.scale[axis], kLeast, kMost);
      };
      box.low[axis] = static_cast<std::int32_t>(std::floor(std::max(kLeast + 1, unit(bounds[axis] - kRounded)) - 1));
      box.high[axis] = static_cast<std::int32_t>(std::ceil(std::min(kMost - 1, unit(bounds[3 + axis] + kRounded)) + 1));
    }
    return box;
  }

  // The strided loads apart from the arithmetic, which then vectorises.
  void unpack(const std::uint8_t* records, std::size_t n, PointBlock& block, std::size_t at) const {
    std::int32_t x[kMmChunk], y[kMmChunk], z[kMmChunk];
    unpack_las(records, n, header_.record_bytes, x, y, z);
    if (reprojection_)
      reproject(x, y, z, n, block, at);
    else
      scaling_.apply(x, y, z, n, block, at);
    if (box_) block.outside_box += outside(*box_, x, y, z, n);
  }
  void reproject(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z, std::size_t n, PointBlock& block,
                 std::size_t at) const {
    Metres moved;
    const std::int32_t* from[3] = {x, y, z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double unit = axis == 2 ? crs_.vertical_m : crs_.horizontal_m;
      for (std::size_t i = 0; i < n; ++i)
        moved.axis[axis][i] = unit * (from[axis][i] * header_.scale[axis] + header_.offset[axis]);
    }
    reprojection_->apply(moved.axis[0], moved.axis[1], moved.axis[2], n);
    moved.round(n, block, at);
  }
  static std::size_t outside(const Box& box, const std::int32_t* x, const std::int32_t* y, const std::int32_t* z,
                             std::size_t n) {
    std::int32_t inside = 0;
    for (std::size_t i = 0; i < n; ++i) {
      inside += static_cast<std::int32_t>((x[i] >= box.low[0]) & (x[i] <= box.high[0]) & (y[i] >= box.low[1]) &
                                          (y[i] <= box.high[1]) & (z[i] >= box.low[2]) & (z[i] <= box.high[2]));
    }
    return n - static_cast<std::size_t>(inside);
  }

  LasHeader header_;
  LasCrs crs_;
  LasScaling scaling_;
  std::optional<Box> box_;  // that the header declares
  std::unique_ptr<Reprojection> reprojection_;
};

}  // namespace

std::unique_ptr<PointFile> open_las(const std::filesystem::path& path, const std::string& crs) {
  return std::make_unique<LasFile>(path, crs);
}

}  // namespace btms
