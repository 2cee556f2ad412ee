#include "io/points/kitti.h"

#include <algorithm>

#include "engine/tiling/millimetres.h"
#include "io/points/input_file.h"
#include "io/points/little_endian.h"
#include "io/points/records.h"

namespace btms {
namespace {

constexpr std::size_t kStride = 16;

class KittiFile final : public PointFile {
 public:
  explicit KittiFile(const std::filesystem::path& path) : PointFile(path) {
    if (file_.size() % kStride != 0) {
      file_.refuse("the file has " + std::to_string(file_.size()) +
                   " bytes, expected a multiple of 16 (float32 x, y, z, intensity)");
    }
    info_.format = "KITTI scan";
    info_.points = file_.size() / kStride;
    if (info_.points == 0) info_.warnings.emplace_back("the scan is empty");
    refuse_swapped_bytes();
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    read_records(file_, {0, kStride}, first, count, block,
                 [&](const std::uint8_t* records, std::size_t n, std::size_t at) { unpack(records, n, block, at); });
  }

  // A float times 1000 is exact in double, so there is one rounding.
  static void unpack(const std::uint8_t* record, std::size_t n, PointBlock& block, std::size_t at) {
    float x[kMmChunk], y[kMmChunk], z[kMmChunk];
    for (std::size_t i = 0; i < n; ++i, record += kStride) {
      x[i] = load<float>(record);
      y[i] = load<float>(record + 4);
      z[i] = load<float>(record + 8);
    }
    round_into<float>({{x, 1000, 0}, {y, 1000, 0}, {z, 1000, 0}}, n, block, at);
  }

  // Swapped, about 4 of 10 numbers are beyond any map and nearly all others close to zero. A look at both ends and the
  // middle is enough and leaves the opening cheap.
  void refuse_swapped_bytes() const {
    constexpr std::size_t kLook = 1024;
    PointBlock block;
    std::uint64_t seen = 0, next = 0, out_of_range = 0;
    const std::uint64_t last = size() - std::min<std::uint64_t>(size(), kLook);
    for (const std::uint64_t start : {std::uint64_t{0}, last / 2, last}) {
      const std::uint64_t from = std::max(start, next), to = std::min<std::uint64_t>(start + kLook, size());
      if (from >= to) continue;
      read(from, to - from, block);
      seen += block.size();
      out_of_range += block.out_of_range;
      next = to;
    }
    if (2 * out_of_range <= seen) return;
    file_.refuse(std::to_string(out_of_range) + " of " + std::to_string(seen) +
                 " points looked at are out of range: looks byte-swapped (big-endian), or not a KITTI scan; expected "
                 "little-endian float32");
  }
};

}  // namespace

std::unique_ptr<PointFile> open_kitti(const std::filesystem::path& path) { return std::make_unique<KittiFile>(path); }

}  // namespace btms
