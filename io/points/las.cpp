#include "io/points/las.h"

#include <cassert>
#include <utility>

#include "io/points/las_crs.h"
#include "io/points/las_header.h"
#include "io/points/little_endian.h"
#include "io/points/millimetres.h"

namespace btms {
namespace {

// Raw records per pread: small enough to be still in the second-level cache when they are unpacked.
constexpr std::size_t kReadBytes = 1 << 18;

// File integer -> millimetres: v * scale + offset, in double. Exact whenever scale and offset are whole millimetres
// (below 2^53), otherwise right to 1e-5 mm.
struct ToMm {
  double scale, offset;
};

class LasFile final : public PointFile {
 public:
  explicit LasFile(const std::filesystem::path& path) : file_(path), header_(read_las_header(file_)) {
    LasCrs crs = read_las_crs(file_, header_);
    const std::array<double, 3> unit_m = {crs.horizontal_m, crs.horizontal_m, crs.vertical_m};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double unit_mm = 1000 * unit_m[axis];
      to_mm_[axis] = {header_.scale[axis] * unit_mm, header_.offset[axis] * unit_mm};
    }
    info_.format =
        "LAS 1." + std::to_string(header_.minor_version) + ", point format " + std::to_string(header_.format);
    info_.points = header_.points;
    info_.bytes = file_.size();
    info_.declared_bounds_m = header_.declared_bounds;
    if (info_.declared_bounds_m)
      for (std::size_t i = 0; i < 6; ++i) (*info_.declared_bounds_m)[i] *= unit_m[i % 3];
    info_.crs = std::move(crs.text);
    info_.warnings = header_.warnings;
    info_.warnings.insert(info_.warnings.end(), crs.warnings.begin(), crs.warnings.end());
  }

  std::string name() const override { return file_.path().string(); }
  std::uint64_t size() const override { return header_.points; }
  const std::filesystem::path& path() const override { return file_.path(); }
  const PointFileInfo& info() const override { return info_; }

  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    assert(first <= size() && count <= size() - first);
    block.reset(count);
    const std::size_t stride = header_.record_bytes, most = kReadBytes / stride;
    const InputFile::Session session = file_.open();
    for (std::size_t done = 0; done < count;) {
      const std::size_t n = std::min(most, count - done);
      if (block.bytes.size() < n * stride) block.bytes.resize(n * stride);
      session.read(header_.points_offset + (first + done) * stride, {block.bytes.data(), n * stride});
      for (std::size_t i = 0; i < n; i += MmChunk::kPoints)
        unpack(block.bytes.data() + i * stride, std::min(MmChunk::kPoints, n - i), block, done + i);
      done += n;
    }
    session.finish();
  }

 private:
  // The strided loads apart from the arithmetic, which then vectorises.
  void unpack(const std::uint8_t* records, std::size_t n, PointBlock& block, std::size_t at) const {
    std::int32_t x[MmChunk::kPoints], y[MmChunk::kPoints], z[MmChunk::kPoints];
    const std::size_t stride = header_.record_bytes;
    for (std::size_t i = 0; i < n; ++i, records += stride) {
      x[i] = load<std::int32_t>(records);
      y[i] = load<std::int32_t>(records + 4);
      z[i] = load<std::int32_t>(records + 8);
    }
    MmChunk chunk;
    scale(x, n, to_mm_[0], chunk.x);
    scale(y, n, to_mm_[1], chunk.y);
    scale(z, n, to_mm_[2], chunk.z);
    round_into(chunk, n, block, at);
  }

  static void scale(const std::int32_t* from, std::size_t n, ToMm to_mm, double* to) {
    for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<double>(from[i]) * to_mm.scale + to_mm.offset;
  }

  InputFile file_;
  LasHeader header_;
  std::array<ToMm, 3> to_mm_{};
  PointFileInfo info_;
};

}  // namespace

std::unique_ptr<PointFile> open_las(const std::filesystem::path& path) { return std::make_unique<LasFile>(path); }

}  // namespace btms
