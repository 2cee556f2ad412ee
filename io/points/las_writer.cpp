#include "io/points/las_writer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <vector>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "io/files/atomic_file.h"
#include "io/points/little_endian.h"

namespace btms {
namespace {

constexpr std::size_t kHeaderBytes = 375, kVlrHead = 54;
constexpr std::size_t kBufferRecords = 16384;
constexpr std::int64_t kOffsetStep_mm = 1'000'000;
constexpr double kScale_m = 0.001;

class Writer final : public LasWriter {
 public:
  Writer(const std::filesystem::path& path, const std::string& crs_wkt, LasPointFormat format)
      : output_(path), wkt_(crs_wkt), format_(format), record_bytes_(format == LasPointFormat::k0 ? 20 : 30) {
    if (wkt_.size() > UINT16_MAX - 1)
      fail("the WKT has " + std::to_string(wkt_.size()) + " bytes, expected at most 65534");
    points_offset_ = kHeaderBytes + (wkt_.empty() ? 0 : kVlrHead + wkt_.size() + 1);
    buffer_.reserve(kBufferRecords * record_bytes_);
  }

  void append(std::span<const LasPoint> points) override {
    for (const LasPoint& point : points) {
      const std::array<std::int64_t, 3> p = {point.x_mm, point.y_mm, point.z_mm};
      if (count_ == 0) start(p);
      if (buffer_.size() == kBufferRecords * record_bytes_) flush();
      buffer_.resize(buffer_.size() + record_bytes_);
      std::uint8_t* record = &buffer_[buffer_.size() - record_bytes_];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        least_[axis] = std::min(least_[axis], p[axis]);
        most_[axis] = std::max(most_[axis], p[axis]);
        store(record + 4 * axis, from_offset(p[axis], axis));
      }
      store(record + 12, point.intensity);
      set_class(record, point.classification);
      ++count_;
    }
  }

  void commit() override {
    flush();
    write_header();
    if (!wkt_.empty()) write_wkt();
    output_.commit();
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorCode::kFailed, message, output_.path().string());
  }

  // And that it is the first of one return.
  void set_class(std::uint8_t* record, std::uint8_t classification) const {
    if (format_ == LasPointFormat::k6) {
      record[14] = 0x11;
      record[16] = classification;
      return;
    }
    if (classification > 31)
      fail("class " + std::to_string(classification) + " does not fit point format 0, expected at most 31");
    record[14] = 0x09;
    record[15] = classification;
  }

  void start(const std::array<std::int64_t, 3>& first) {
    for (std::size_t axis = 0; axis < 2; ++axis)  // heights fit without an offset
      offset_mm_[axis] = floor_div(first[axis] + kOffsetStep_mm / 2, kOffsetStep_mm) * kOffsetStep_mm;
    least_ = most_ = first;
  }

  std::int32_t from_offset(std::int64_t mm, std::size_t axis) const {
    const std::int64_t value = mm - offset_mm_[axis];
    if (value < std::numeric_limits<std::int32_t>::min() || value > std::numeric_limits<std::int32_t>::max()) {
      fail("a point at " + std::string(1, "xyz"[axis]) + " = " + std::to_string(mm) +
           " mm is too far from the first (" + std::to_string(offset_mm_[axis]) + " mm): expected within 2147 km");
    }
    return static_cast<std::int32_t>(value);
  }

  void flush() {
    output_.write(written_to_ == 0 ? points_offset_ : written_to_, buffer_);
    written_to_ = (written_to_ == 0 ? points_offset_ : written_to_) + buffer_.size();
    buffer_.clear();
  }

  void write_header() {
    std::array<std::uint8_t, kHeaderBytes> b{};  // no dates: equal scenes are equal files
    std::memcpy(b.data(), "LASF", 4);
    store(&b[6], std::uint16_t{0x10});  // the coordinate system is WKT: formats 6-10 demand it, 0 allows it
    b[24] = 1;
    b[25] = 4;
    std::memcpy(&b[26], "B-TMS Engine", 12);
    std::memcpy(&b[58], "B-TMS Engine", 12);
    store(&b[94], static_cast<std::uint16_t>(kHeaderBytes));
    store(&b[96], static_cast<std::uint32_t>(points_offset_));
    store(&b[100], std::uint32_t{wkt_.empty() ? 0u : 1u});
    b[104] = static_cast<std::uint8_t>(format_);
    store(&b[105], static_cast<std::uint16_t>(record_bytes_));
    if (format_ == LasPointFormat::k0) {  // the counts of LAS 1.2 too
      if (count_ > UINT32_MAX) fail("more points than point format 0 can count");
      store(&b[107], static_cast<std::uint32_t>(count_));
      store(&b[111], static_cast<std::uint32_t>(count_));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      store(&b[131 + 8 * axis], kScale_m);
      store(&b[155 + 8 * axis], static_cast<double>(offset_mm_[axis]) / 1000);
      store(&b[179 + 16 * axis], static_cast<double>(most_[axis]) / 1000);
      store(&b[187 + 16 * axis], static_cast<double>(least_[axis]) / 1000);
    }
    store(&b[247], count_);
    store(&b[255], count_);  // points by return: all are first returns
    output_.write(0, b);
  }

  void write_wkt() {
    std::vector<std::uint8_t> vlr(kVlrHead + wkt_.size() + 1);
    std::memcpy(&vlr[2], "LASF_Projection", 15);
    store(&vlr[18], std::uint16_t{2112});
    store(&vlr[20], static_cast<std::uint16_t>(wkt_.size() + 1));
    std::memcpy(&vlr[kVlrHead], wkt_.data(), wkt_.size());
    output_.write(kHeaderBytes, vlr);
  }

  AtomicFile output_;
  std::string wkt_;
  LasPointFormat format_;
  std::size_t record_bytes_;
  std::uint64_t points_offset_ = 0, written_to_ = 0, count_ = 0;
  std::array<std::int64_t, 3> offset_mm_{}, least_{}, most_{};
  std::vector<std::uint8_t> buffer_;
};

}  // namespace

std::unique_ptr<LasWriter> LasWriter::create(const std::filesystem::path& path, const std::string& crs_wkt,
                                             LasPointFormat format) {
  return std::make_unique<Writer>(path, crs_wkt, format);
}

}  // namespace btms
