#include "io/points/las.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "io/points/las_crs.h"
#include "io/points/las_header.h"
#include "io/points/las_scaling.h"
#include "io/points/las_unpack.h"
#include "io/points/records.h"

namespace btms {
namespace {

class LasFile final : public PointFile {
 public:
  explicit LasFile(const std::filesystem::path& path)
      : file_(path),
        header_(read_las_header(file_)),
        crs_(read_las_crs(file_, header_)),
        scaling_(times_unit(header_.scale, 1000), times_unit(header_.offset, 1000)) {
    info_.format =
        "LAS 1." + std::to_string(header_.minor_version) + ", point format " + std::to_string(header_.format);
    info_.points = header_.points;
    info_.bytes = file_.size();
    info_.declared_bounds_m = header_.declared_bounds;
    if (info_.declared_bounds_m)
      for (std::size_t i = 0; i < 6; ++i)
        (*info_.declared_bounds_m)[i] *= i % 3 == 2 ? crs_.vertical_m : crs_.horizontal_m;
    if (header_.declared_bounds) box_ = units_of(*header_.declared_bounds);
    info_.crs = crs_.text;
    info_.warnings = header_.warnings;
    info_.warnings.insert(info_.warnings.end(), crs_.warnings.begin(), crs_.warnings.end());
  }

  std::string name() const override { return file_.path().string(); }
  std::uint64_t size() const override { return header_.points; }
  const std::filesystem::path& path() const override { return file_.path(); }
  const PointFileInfo& info() const override { return info_; }

  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    assert(first <= size() && count <= size() - first);
    block.reset(count);
    read_records(file_, {header_.points_offset, header_.record_bytes}, first, count, block,
                 [&](const std::uint8_t* records, std::size_t n, std::size_t at) { unpack(records, n, block, at); });
  }

 private:
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
    scaling_.apply(x, y, z, n, block, at);
    if (box_) block.outside_box += outside(*box_, x, y, z, n);
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

  InputFile file_;
  LasHeader header_;
  LasCrs crs_;
  LasScaling scaling_;
  std::optional<Box> box_;  // that the header declares
  PointFileInfo info_;
};

}  // namespace

std::unique_ptr<PointFile> open_las(const std::filesystem::path& path) { return std::make_unique<LasFile>(path); }

}  // namespace btms
