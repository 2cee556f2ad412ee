#include "io/points/laz_layout.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "io/points/las_header.h"
#include "io/points/las_records.h"
#include "io/points/little_endian.h"

namespace btms {
namespace {

// Byte offsets in the header (ASPRS LAS 1.4 R15, table 3), and in the LASzip record.
enum Field : std::size_t {
  kMinor = 25,
  kHeaderBytes = 94,
  kPointsOffset = 96,
  kVlrCount = 100,
  kFormat = 104,
  kRecordBytes = 105,
  kLegacyCount = 107,
  kEvlrStart = 235,
  kEvlrCount = 243,
  kCount = 247
};
constexpr std::size_t kShortHeader = 227, kLongHeader = 375, kVlrHead = 54, kEvlrHead = 60;
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{64} << 20;  // of all VLRs, and of all EVLRs
constexpr std::uint8_t kCompressed = 0x80, kFormatBits = 0x3F;       // bit 6 is a second mark of LAZ
constexpr std::uint32_t kVariableChunks = UINT32_MAX;

std::string number(std::uint64_t n) { return std::to_string(n); }

class Reader {
 public:
  explicit Reader(const InputFile& file) : file_(file), session_(file.open()) {}

  LazLayout read() {
    if (file_.size() < kShortHeader)
      file_.refuse("the file has " + number(file_.size()) + " bytes, shorter than a LAZ header (227)");
    layout_.head = bytes(0, kShortHeader);
    if (std::memcmp(layout_.head.data(), "LASF", 4) != 0)
      file_.refuse("not a LAZ file: expected it to start with \"LASF\"", 0);
    const std::size_t header = field<std::uint16_t>(kHeaderBytes);
    wide_ = layout_.head[kMinor] >= 4;
    points_offset_ = field<std::uint32_t>(kPointsOffset);
    if (header < (wide_ ? kLongHeader : kShortHeader) || header > points_offset_ || points_offset_ > file_.size())
      file_.refuse("header of " + number(header) + " bytes and points from byte " + number(points_offset_) +
                       " on don't fit a file of " + number(file_.size()) + " bytes; it is truncated or damaged",
                   kHeaderBytes);
    if ((layout_.head[kFormat] & kCompressed) == 0)
      file_.refuse("the points are not compressed; if this is a LAS file, call it .las", kFormat);
    layout_.head = bytes(0, header);
    layout_.points = wide_ ? field<std::uint64_t>(kCount) : field<std::uint32_t>(kLegacyCount);
    layout_.record_bytes = field<std::uint16_t>(kRecordBytes);
    check_format();
    copy_vlrs(header);
    copy_evlrs();
    check_chunks();
    session_.finish();
    finish_header();
    return std::move(layout_);
  }

 private:
  template <typename T>
  T field(std::size_t at) const {
    return load<T>(&layout_.head[at]);
  }

  std::vector<std::uint8_t> bytes(std::uint64_t from, std::uint64_t n) const {
    std::vector<std::uint8_t> result(n);
    session_.read(from, result);
    return result;
  }

  void check_format() const {
    const unsigned format = layout_.head[kFormat] & kFormatBits;
    if (format > 10 || format == 4 || format == 5)
      file_.refuse("point format " + number(format) + ", expected 0 to 3 or 6 to 10 in a LAZ file", kFormat);
    if (layout_.record_bytes < kLasRecordBytes[format])
      file_.refuse("records of " + number(layout_.record_bytes) + " bytes, expected at least " +
                       number(kLasRecordBytes[format]) + " for point format " + number(format),
                   kRecordBytes);
    std::uint64_t all = 0;
    if (__builtin_mul_overflow(layout_.points, layout_.record_bytes, &all) || all > std::uint64_t{1} << 46)
      file_.refuse("header declares " + number(layout_.points) + " points; it is damaged",
                   wide_ ? kCount : kLegacyCount);
  }

  // Copies what a LAS file has as well; takes notes of what only LAZ has.
  void copy_vlrs(std::size_t header) {
    if (points_offset_ - header > kMostRecordBytes)
      file_.refuse("VLRs of more than " + number(kMostRecordBytes) + " bytes", kPointsOffset);
    LasHeader found;
    found.header_bytes = static_cast<std::uint16_t>(header);
    found.points_offset = points_offset_;
    find_vlrs(file_, session_, field<std::uint32_t>(kVlrCount), found);
    for (const LasRecord& record : found.records) {
      if (record.user == "laszip encoded" && record.id == 22204) {
        read_laszip(record);
      } else if (record.user != "copc") {
        append(layout_.head, record.offset - kVlrHead, kVlrHead + record.bytes);
        ++vlrs_;
      }
    }
    if (!has_laszip_) file_.refuse("compressed, but without the record that says how (LASzip VLR)", kVlrCount);
  }

  void read_laszip(const LasRecord& record) {
    constexpr std::uint64_t kLeast = 34;
    if (record.bytes < kLeast) file_.refuse("the LASzip record has " + number(record.bytes) + " bytes", record.offset);
    const auto content = bytes(record.offset, kLeast);
    const unsigned compressor = load<std::uint16_t>(content.data());
    if (compressor != 2 && compressor != 3)
      file_.refuse("LASzip compressor " + number(compressor) + ", expected 2 or 3 (in chunks)", record.offset);
    chunk_points_ = load<std::uint32_t>(&content[12]);
    has_laszip_ = true;
  }

  void copy_evlrs() {
    const std::uint32_t count = wide_ ? field<std::uint32_t>(kEvlrCount) : 0;
    if (count == 0) return;
    LasHeader found;
    found.points_offset = points_offset_;  // and no points: the compressed ones end somewhere behind it
    find_evlrs(file_, session_, field<std::uint64_t>(kEvlrStart), count, found);
    for (const LasRecord& record : found.records) {
      if (record.user == "copc") continue;
      if (layout_.tail.size() + record.bytes > kMostRecordBytes)
        file_.refuse("EVLRs of more than " + number(kMostRecordBytes) + " bytes", record.offset);
      append(layout_.tail, record.offset - kEvlrHead, kEvlrHead + record.bytes);
      ++evlrs_;
    }
  }

  void append(std::vector<std::uint8_t>& to, std::uint64_t from, std::uint64_t n) const {
    to.resize(to.size() + n);
    session_.read(from, std::span(to).last(n));
  }

  // The table of chunks stands behind the last one: a truncated file has none. Its length is not compressed.
  void check_chunks() const {
    constexpr std::uint64_t kNumber = 8;
    const auto refuse = [&](const std::string& what) {
      file_.refuse(what + "; the file is truncated or damaged", points_offset_);
    };
    if (layout_.points == 0) return;
    if (file_.size() - points_offset_ < 2 * kNumber) refuse("no compressed points");
    std::uint64_t table = load<std::uint64_t>(bytes(points_offset_, kNumber).data());
    if (table == UINT64_MAX)
      table = load<std::uint64_t>(bytes(file_.size() - kNumber, kNumber).data());  // was streamed
    if (table < points_offset_ + kNumber || table > file_.size() - kNumber)
      refuse("the table of chunks is said to be at byte " + number(table) + " of " + number(file_.size()));
    const auto start = bytes(table, kNumber);
    const std::uint64_t chunks = load<std::uint32_t>(&start[4]);
    const std::uint64_t room = table - points_offset_ - kNumber;
    if (load<std::uint32_t>(start.data()) != 0 || chunks == 0 || chunks > room / layout_.record_bytes)
      refuse("the table of chunks declares " + number(chunks) + " chunks in " + number(room) + " bytes");
    if (chunk_points_ == kVariableChunks || chunk_points_ == 0) return;  // COPC writers put either
    const std::uint64_t expected = (layout_.points - 1) / chunk_points_ + 1;
    if (chunks < expected || chunks > expected + 1)  // some writers end with an empty one
      refuse("header declares " + number(layout_.points) + " points, that is " + number(expected) + " chunks of " +
             number(chunk_points_) + "; found " + number(chunks));
  }

  void finish_header() {
    std::uint8_t* const head = layout_.head.data();
    head[kFormat] &= kFormatBits;
    store(head + kPointsOffset, static_cast<std::uint32_t>(layout_.head.size()));
    store(head + kVlrCount, vlrs_);
    if (!wide_) return;
    store(head + kEvlrCount, evlrs_);
    store(head + kEvlrStart, evlrs_ == 0 ? 0 : layout_.las_bytes() - layout_.tail.size());
  }

  const InputFile& file_;
  InputFile::Session session_;
  LazLayout layout_;
  bool wide_ = false, has_laszip_ = false;
  std::uint64_t points_offset_ = 0;  // of the LAZ file
  std::uint32_t chunk_points_ = 0, vlrs_ = 0, evlrs_ = 0;
};

}  // namespace

LazLayout read_laz_layout(const InputFile& file) { return Reader(file).read(); }

}  // namespace btms
