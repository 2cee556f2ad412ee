#include "io/points/las.h"

#include <algorithm>
#include <cassert>

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

  // The strided loads apart from the arithmetic, which then vectorises.
  void unpack(const std::uint8_t* records, std::size_t n, PointBlock& block, std::size_t at) const {
    std::int32_t x[kMmChunk], y[kMmChunk], z[kMmChunk];
    unpack_las(records, n, header_.record_bytes, x, y, z);
    scaling_.apply(x, y, z, n, block, at);
  }

  InputFile file_;
  LasHeader header_;
  LasCrs crs_;
  LasScaling scaling_;
  PointFileInfo info_;
};

}  // namespace

std::unique_ptr<PointFile> open_las(const std::filesystem::path& path) { return std::make_unique<LasFile>(path); }

}  // namespace btms
