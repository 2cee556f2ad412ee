#include "io/points/pcd.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include "engine/tiling/millimetres.h"
#include "io/points/little_endian.h"
#include "io/points/lzf.h"
#include "io/points/metres.h"
#include "io/points/pcd_header.h"
#include "io/points/point_lines.h"
#include "io/points/records.h"

namespace btms {
namespace {

constexpr const char* kDataNames[] = {"ascii", "binary", "binary_compressed"};

// What compressed files may keep unpacked, all open ones together.
class ColumnMemory {
 public:
  ColumnMemory() = default;
  ColumnMemory(const ColumnMemory&) = delete;
  ColumnMemory& operator=(const ColumnMemory&) = delete;
  ~ColumnMemory() { used_bytes -= mine_bytes_; }
  // False when it would be too much.
  bool take(std::uint64_t bytes) {
    mine_bytes_ = bytes;
    if (used_bytes.fetch_add(bytes) + bytes <= kMost_bytes) return true;
    used_bytes -= std::exchange(mine_bytes_, 0);
    return false;
  }

 private:
  static constexpr std::uint64_t kMost_bytes = std::uint64_t{1} << 28;
  static inline std::atomic<std::uint64_t> used_bytes = 0;
  std::uint64_t mine_bytes_ = 0;
};

class PcdFile final : public PointFile {
 public:
  explicit PcdFile(const std::filesystem::path& path) : PointFile(path), header_(read_pcd_header(file_)) {
    info_.format = "PCD " + header_.version + " " + kDataNames[static_cast<int>(header_.data)];
    info_.points = header_.points;
    info_.warnings = header_.warnings;
    if (header_.points == 0) info_.warnings.emplace_back("the file has no points");
    switch (header_.data) {
      case PcdData::kAscii:
        open_ascii();
        break;
      case PcdData::kBinary:
        open_binary();
        break;
      case PcdData::kCompressed:
        open_compressed();
        break;
    }
    warn_of_coarse_floats();
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    switch (header_.data) {
      case PcdData::kAscii:
        return read_ascii(first, count, block);
      case PcdData::kBinary:
        return read_binary(first, count, block);
      case PcdData::kCompressed:
        return read_compressed(first, count, block);
    }
  }

  // Bytes of all records. Fits 64 bits, or the file would not be long enough.
  std::uint64_t record_bytes(std::uint64_t room) const {
    std::uint64_t bytes = 0;
    const bool overflow = __builtin_mul_overflow(header_.points, header_.stride, &bytes);
    if (!overflow && bytes <= room) return bytes;
    file_.refuse("header declares " + std::to_string(header_.points) + " points of " + std::to_string(header_.stride) +
                     " bytes, found " + std::to_string(room / header_.stride) + " whole records; the file is truncated",
                 header_.data_offset);
  }

  void warn_of_trailing(std::uint64_t bytes) {
    if (bytes != 0) info_.warnings.push_back(std::to_string(bytes) + " bytes behind the last point: ignored");
  }

  void open_ascii() {
    LineLayout layout;
    layout.offset = header_.data_offset;
    layout.line = header_.data_line + 1;
    layout.points = header_.points;
    layout.columns = header_.columns;
    for (std::size_t axis = 0; axis < 3; ++axis) layout.xyz[axis] = header_.xyz[axis].column;
    lines_.emplace(file_, layout);
    if (lines_->trailing()) info_.warnings.emplace_back("there are lines behind the last point: ignored");
  }

  void open_binary() {
    const std::uint64_t room = file_.size() - header_.data_offset;
    warn_of_trailing(room - record_bytes(room));
  }

  void open_compressed() {
    const std::uint64_t room = file_.size() - header_.data_offset;
    std::uint8_t sizes[8];
    if (room < sizeof sizes) file_.refuse("the file ends before the compressed data", file_.size());
    file_.open().read(header_.data_offset, sizes);
    const std::uint64_t packed = load<std::uint32_t>(sizes), unpacked = load<std::uint32_t>(sizes + 4);
    if (packed > room - sizeof sizes) {
      file_.refuse("compressed data of " + std::to_string(packed) + " bytes, found " +
                       std::to_string(room - sizeof sizes) + "; the file is truncated",
                   header_.data_offset);
    }
    if (record_bytes(UINT32_MAX) != unpacked) {
      file_.refuse("compressed data of " + std::to_string(unpacked) + " bytes when unpacked, expected " +
                       std::to_string(header_.points * header_.stride) + " for " + std::to_string(header_.points) +
                       " points",
                   header_.data_offset + 4);
    }
    warn_of_trailing(room - sizeof sizes - packed);
    keep_columns(packed, unpacked);
    packed_.emplace(file_, header_.data_offset + sizeof sizes, packed, unpacked,
                    [&](std::uint64_t from, std::span<const std::uint8_t> output) { fill_columns(from, output); });
  }

  // Unpacked, all values of a field follow each other: field offset * points is where a column starts.
  std::uint64_t column_start(std::size_t axis) const { return header_.xyz[axis].offset * header_.points; }

  // Makes room for the coordinates, so that they are unpacked once; where there is too little, or the sizes are a lie
  // (no instruction of 3 bytes makes more than 264), each read unpacks what it needs.
  void keep_columns(std::uint64_t packed, std::uint64_t unpacked) {
    constexpr std::uint64_t kMostExpansion = 88;
    std::uint64_t bytes = 0;
    for (const PcdField& field : header_.xyz) bytes += field.bytes * header_.points;
    if (unpacked > kMostExpansion * packed || !memory_.take(bytes)) return;
    for (std::size_t axis = 0; axis < 3; ++axis) columns_[axis].resize(header_.xyz[axis].bytes * header_.points);
  }

  void fill_columns(std::uint64_t from, std::span<const std::uint8_t> output) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint64_t start = column_start(axis), end = start + columns_[axis].size();
      const std::uint64_t begin = std::max(from, start), stop = std::min(from + output.size(), end);
      if (begin < stop) std::memcpy(&columns_[axis][begin - start], &output[begin - from], stop - begin);
    }
  }

  void warn_of_coarse_floats() {
    if (header_.data == PcdData::kAscii) return;  // read as double, whatever SIZE says
    if (header_.xyz[0].bytes == 4 || header_.xyz[1].bytes == 4) btms::warn_of_coarse_floats(*this, info_.warnings);
  }

  void read_ascii(std::uint64_t first, std::size_t count, PointBlock& block) const {
    read_lines(*lines_, file_, first, count, block);
  }

  void read_binary(std::uint64_t first, std::size_t count, PointBlock& block) const {
    read_records(file_, {header_.data_offset, header_.stride}, first, count, block,
                 [&](const std::uint8_t* records, std::size_t n, std::size_t at) { unpack(records, n, block, at); });
  }

  void unpack(const std::uint8_t* records, std::size_t n, PointBlock& block, std::size_t at) const {
    Metres chunk;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PcdField& field = header_.xyz[axis];
      chunk.unpack(axis, records + field.offset, header_.stride, float_of(field.bytes), n);
    }
    chunk.round(n, block, at);
  }

  void read_compressed(std::uint64_t first, std::size_t count, PointBlock& block) const {
    std::array<std::vector<std::uint8_t>, 3> unpacked;
    std::array<const std::uint8_t*, 3> columns{};
    const InputFile::Session session = file_.open();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t bytes = header_.xyz[axis].bytes;
      if (!columns_[axis].empty()) {
        columns[axis] = columns_[axis].data() + first * bytes;
        continue;
      }
      unpacked[axis].resize(count * bytes);
      packed_->read(file_, session, column_start(axis) + first * bytes, unpacked[axis], block.bytes);
      columns[axis] = unpacked[axis].data();
    }
    session.finish();
    Metres chunk;
    for (std::size_t done = 0; done < count; done += kMmChunk) {
      const std::size_t n = std::min(kMmChunk, count - done);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t bytes = header_.xyz[axis].bytes;
        chunk.unpack(axis, columns[axis] + done * bytes, bytes, float_of(bytes), n);
      }
      chunk.round(n, block, done);
    }
  }

  PcdHeader header_;
  std::optional<PointLines> lines_;  // ascii only
  std::optional<LzfRange> packed_;   // binary_compressed only
  ColumnMemory memory_;
  std::array<std::vector<std::uint8_t>, 3> columns_;  // x, y, z of a compressed file, unpacked; empty without memory
};

}  // namespace

std::unique_ptr<PointFile> open_pcd(const std::filesystem::path& path) { return std::make_unique<PcdFile>(path); }

}  // namespace btms
