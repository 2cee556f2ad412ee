#include "bench/point_formats.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "bench/measure.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

float metres(std::int64_t mm) { return static_cast<float>(static_cast<double>(mm) / 1000); }

void append_raw(std::vector<std::uint8_t>& out, float value) {
  std::uint8_t raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  out.insert(out.end(), raw, raw + sizeof value);
}

void append_size(std::vector<std::uint8_t>& out, std::size_t size) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(size >> shift));
}

std::vector<std::uint8_t> records(const PointBlock& points, bool intensity) {
  std::vector<std::uint8_t> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    append_raw(out, metres(points.x_mm[i]));
    append_raw(out, metres(points.y_mm[i]));
    append_raw(out, metres(points.z_mm[i]));
    if (intensity) append_raw(out, 0);
  }
  return out;
}

// Millimetres, the text a surveyor would see.
std::vector<std::uint8_t> lines(const PointBlock& points) {
  std::vector<std::uint8_t> out;
  char line[96];
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int n = std::snprintf(line, sizeof line, "%.3f %.3f %.3f\n", static_cast<double>(points.x_mm[i]) / 1000,
                                static_cast<double>(points.y_mm[i]) / 1000, points.z_mm[i] / 1000.0);
    out.insert(out.end(), line, line + n);
  }
  return out;
}

// Column after column, packed, behind both sizes.
std::vector<std::uint8_t> columns(const PointBlock& points) {
  std::vector<std::uint8_t> raw;
  for (const std::int64_t mm : points.x_mm) append_raw(raw, metres(mm));
  for (const std::int64_t mm : points.y_mm) append_raw(raw, metres(mm));
  for (const std::int64_t mm : points.z_mm) append_raw(raw, metres(mm));
  const std::vector<std::uint8_t> packed = lzf_compress(raw);
  std::vector<std::uint8_t> out;
  append_size(out, packed.size());
  append_size(out, raw.size());
  out.insert(out.end(), packed.begin(), packed.end());
  return out;
}

void write_file(const fs::path& path, const std::string& header, const std::vector<std::uint8_t>& body) {
  std::ofstream file(path, std::ios::binary);
  file << header;
  file.write(reinterpret_cast<const char*>(body.data()), static_cast<std::streamsize>(body.size()));
  file.close();
  verify(file.good(), "cannot write " + path.string());
}

}  // namespace

void write_kitti(const fs::path& path, const PointBlock& points) { write_file(path, "", records(points, true)); }

void write_pcd(const fs::path& path, const PointBlock& points, PcdKind kind) {
  const std::string n = std::to_string(points.size());
  const std::string header = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + n +
                             "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA ";
  switch (kind) {
    case PcdKind::kAscii:
      return write_file(path, header + "ascii\n", lines(points));
    case PcdKind::kBinary:
      return write_file(path, header + "binary\n", records(points, false));
    case PcdKind::kCompressed:
      return write_file(path, header + "binary_compressed\n", columns(points));
  }
}

std::vector<std::uint8_t> lzf_compress(std::span<const std::uint8_t> input) {
  constexpr std::size_t kReach = 8192, kLongest = 264, kRun = 32, kShortest = 3;
  std::vector<std::size_t> last(1 << 14, SIZE_MAX);  // by hash of three bytes
  std::vector<std::uint8_t> out;
  std::size_t literal = 0, at = 0;
  const auto flush = [&](std::size_t end) {
    while (literal < end) {
      const std::size_t n = std::min(kRun, end - literal);
      out.push_back(static_cast<std::uint8_t>(n - 1));
      out.insert(out.end(), input.begin() + static_cast<std::ptrdiff_t>(literal),
                 input.begin() + static_cast<std::ptrdiff_t>(literal + n));
      literal += n;
    }
  };
  while (at + kShortest <= input.size()) {
    const std::uint32_t three = input[at] | input[at + 1] << 8 | input[at + 2] << 16;
    std::size_t& slot = last[three * 2654435761u >> 18];
    const std::size_t from = slot;
    slot = at;
    std::size_t n = 0;
    if (from != SIZE_MAX && at - from <= kReach)
      while (n < kLongest && at + n < input.size() && input[from + n] == input[at + n]) ++n;
    if (n < kShortest) {
      ++at;
      continue;
    }
    flush(at);
    const std::size_t back = at - from - 1, length = n - 2;
    out.push_back(static_cast<std::uint8_t>(std::min<std::size_t>(length, 7) << 5 | back >> 8));
    if (length >= 7) out.push_back(static_cast<std::uint8_t>(length - 7));
    out.push_back(static_cast<std::uint8_t>(back & 0xFF));
    literal = at += n;
  }
  flush(input.size());
  return out;
}

}  // namespace btms::bench
