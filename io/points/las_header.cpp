#include "io/points/las_header.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "io/points/las_records.h"
#include "io/points/little_endian.h"

namespace btms {
namespace {

constexpr std::size_t kShortHeader = 227, kLongHeader = 375;  // LAS 1.0-1.3, LAS 1.4

// Byte offsets of the fields we look at (ASPRS LAS 1.4 R15, table 3).
enum Field : std::size_t {
  kMajor = 24,
  kMinor = 25,
  kHeaderBytes = 94,
  kPointsOffset = 96,
  kVlrCount = 100,
  kFormat = 104,
  kRecordBytes = 105,
  kLegacyCount = 107,
  kScale = 131,
  kOffset = 155,
  kBounds = 179,
  kWaveforms = 227,
  kEvlrStart = 235,
  kEvlrCount = 243,
  kCount = 247
};

using Bytes = std::array<std::uint8_t, kLongHeader>;

std::string number(std::uint64_t n) { return std::to_string(n); }

std::string decimal(double v) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, v).ptr};
}

const char* const kNoLaz = "the points are compressed (LAZ); call the file .laz";

// Magic, version and size of the header: what is needed to know how to read the rest.
void read_preamble(const InputFile& file, const Bytes& b, LasHeader& h) {
  if (std::memcmp(b.data(), "LASF", 4) != 0) file.refuse("not a LAS file: expected it to start with \"LASF\"", 0);
  h.minor_version = b[kMinor];
  if (b[kMajor] != 1 || h.minor_version > 4) {
    file.refuse("LAS version " + number(b[kMajor]) + "." + number(b[kMinor]) + ", expected 1.0 to 1.4", kMajor);
  }
  const std::size_t least = h.minor_version == 4 ? kLongHeader : kShortHeader;
  h.header_bytes = load<std::uint16_t>(&b[kHeaderBytes]);
  if (h.header_bytes < least || h.header_bytes > file.size()) {
    file.refuse("header of " + number(h.header_bytes) + " bytes, expected " + number(least) + " to " +
                    number(file.size()) + " (the file's length)",
                kHeaderBytes);
  }
}

void read_format(const InputFile& file, const Bytes& b, LasHeader& h) {
  h.format = b[kFormat];
  if ((h.format & 0x80) != 0) file.refuse(kNoLaz, kFormat);
  if (h.format >= kLasFormats) file.refuse("point format " + number(h.format) + ", expected 0 to 10", kFormat);
  h.record_bytes = load<std::uint16_t>(&b[kRecordBytes]);
  if (h.record_bytes < kLasRecordBytes[h.format]) {
    file.refuse("records of " + number(h.record_bytes) + " bytes, expected at least " +
                    number(kLasRecordBytes[h.format]) + " for point format " + number(h.format),
                kRecordBytes);
  }
  h.points_offset = load<std::uint32_t>(&b[kPointsOffset]);
  if (h.points_offset < h.header_bytes || h.points_offset > file.size()) {
    file.refuse("points start at byte " + number(h.points_offset) + ", expected " + number(h.header_bytes) +
                    " (end of the header) to " + number(file.size()) + " (end of the file)",
                kPointsOffset);
  }
}

void read_count(const InputFile& file, const Bytes& b, LasHeader& h) {
  const std::uint64_t legacy = load<std::uint32_t>(&b[kLegacyCount]);
  const bool wide = h.minor_version == 4;
  h.points = wide ? load<std::uint64_t>(&b[kCount]) : legacy;
  const std::uint64_t room = file.size() - h.points_offset, whole = room / h.record_bytes;
  if (h.points > whole) {
    file.refuse("header declares " + number(h.points) + " points of " + number(h.record_bytes) + " bytes, found " +
                    number(whole) + " whole records" + (room % h.record_bytes != 0 ? " and a part of one" : "") +
                    "; the file is truncated or its header damaged",
                wide ? kCount : kLegacyCount);
  }
  if (!wide) return;
  if (h.format >= 6 && legacy != 0) {
    h.warnings.push_back("the legacy point count is " + number(legacy) + ", expected 0 for point format " +
                         number(h.format) + ": ignored");
  } else if (h.format < 6 && legacy != h.points && h.points <= UINT32_MAX) {
    h.warnings.push_back("the legacy point count is " + number(legacy) + ", the LAS 1.4 count " + number(h.points) +
                         ": the latter is used");
  }
}

void read_scale(const InputFile& file, const Bytes& b, LasHeader& h) {
  // Finer than a nanometre or coarser than a kilometre is damage, not a survey. Wider bounds would not overflow either.
  constexpr double kFinest = 1e-9, kCoarsest = 1e3, kFarthest = 1e12;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double scale = h.scale[axis] = load<double>(&b[kScale + 8 * axis]);
    const double offset = h.offset[axis] = load<double>(&b[kOffset + 8 * axis]);
    const std::string name(1, "xyz"[axis]);
    if (!(scale >= kFinest && scale <= kCoarsest))
      file.refuse(name + " scale " + decimal(scale) + ", expected 1e-9 to 1000", kScale + 8 * axis);
    if (!(std::abs(offset) <= kFarthest))
      file.refuse(name + " offset " + decimal(offset) + ", expected a coordinate", kOffset + 8 * axis);
  }
}

void read_bounds(const Bytes& b, LasHeader& h) {
  std::array<double, 6> bounds;
  bool sound = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {  // the file has max x, min x, max y, ...
    bounds[3 + axis] = load<double>(&b[kBounds + 16 * axis]);
    bounds[axis] = load<double>(&b[kBounds + 16 * axis + 8]);
    sound = sound && bounds[axis] <= bounds[3 + axis];
  }
  if (sound) h.declared_bounds = bounds;
  if (!sound && h.points != 0) h.warnings.emplace_back("the declared bounding box is empty or not a number: ignored");
}

// What lies behind the points: extended records, waveforms, or something nobody declared.
void read_tail(const InputFile& file, const InputFile::Session& session, const Bytes& b, LasHeader& h) {
  std::uint64_t known_end = h.points_end();
  const std::uint64_t waveforms =
      h.minor_version >= 3 && h.header_bytes >= kWaveforms + 8 ? load<std::uint64_t>(&b[kWaveforms]) : 0;
  const std::uint32_t evlrs = h.minor_version == 4 ? load<std::uint32_t>(&b[kEvlrCount]) : 0;
  const std::uint64_t evlr_start = load<std::uint64_t>(&b[kEvlrStart]);
  std::uint64_t next = file.size();  // where something declared follows the points
  if (evlrs != 0) {
    known_end = find_evlrs(file, session, evlr_start, evlrs, h);
    next = evlr_start;
  }
  if (waveforms >= h.points_end() && waveforms < file.size()) {
    known_end = file.size();  // never followed, so their length is not known
    next = std::min(next, waveforms);
  }
  if (h.points == 0) {
    const std::uint64_t records = (next - h.points_offset) / h.record_bytes;
    if (records != 0) {
      file.refuse("header declares 0 points, found room for " + number(records) +
                      " records behind it; the writer was interrupted",
                  h.minor_version == 4 ? kCount : kLegacyCount);
    }
    h.warnings.emplace_back("the file has no points");
  }
  if (known_end < file.size())
    h.warnings.push_back(number(file.size() - known_end) + " bytes behind the last point are not declared: ignored");
}

}  // namespace

LasHeader read_las_header(const InputFile& file) {
  if (file.size() < kShortHeader) {
    file.refuse(file.size() == 0 ? "the file is empty; expected a LAS header of 227 bytes or more"
                                 : "the file has " + number(file.size()) + " bytes, shorter than a LAS header (227)");
  }
  const InputFile::Session session = file.open();
  Bytes b{};
  session.read(0, std::span(b).first(std::min<std::uint64_t>(b.size(), file.size())));
  LasHeader h;
  read_preamble(file, b, h);
  read_format(file, b, h);
  find_vlrs(file, session, load<std::uint32_t>(&b[kVlrCount]), h);
  for (const LasRecord& record : h.records)
    if (record.user == "laszip encoded" && record.id == 22204) file.refuse(kNoLaz, record.offset);
  read_count(file, b, h);
  read_scale(file, b, h);
  read_bounds(b, h);
  read_tail(file, session, b, h);
  session.finish();
  return h;
}

}  // namespace btms
