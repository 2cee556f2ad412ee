// LAS files made by hand, field by field, so that the tests do not lean on the code they test.
#pragma once

#include <array>
#include <cstring>
#include <string>

#include "tests/io/points/files.h"

namespace btms::test {

struct Vlr {
  std::string user;
  std::uint16_t id = 0;
  Bytes content;
};

struct LasSpec {
  std::uint8_t minor = 2, format = 0;
  std::uint16_t extra_bytes = 0;  // behind the record of the format
  std::array<double, 3> scale{0.001, 0.001, 0.001}, offset{};
  std::vector<std::array<std::int32_t, 3>> xyz{{1000, 2000, 3000}, {-1500, 2500, -3500}, {0, 0, 0}};
  std::vector<Vlr> vlrs, evlrs;
};

inline std::uint16_t format_bytes(std::uint8_t format) {
  constexpr std::uint16_t kBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  return kBytes[format];
}

// Where the class is: byte and bits.
inline std::size_t class_offset(std::uint8_t format) { return format < 6 ? 15 : 16; }
inline std::uint8_t class_bits(std::uint8_t format) { return format < 6 ? 0x1F : 0xFF; }

inline std::size_t header_bytes(const LasSpec& spec) { return spec.minor == 4 ? 375 : spec.minor == 3 ? 235 : 227; }
inline std::size_t record_bytes(const LasSpec& spec) {
  return static_cast<std::size_t>(format_bytes(spec.format) + spec.extra_bytes);
}
inline std::size_t points_offset(const LasSpec& spec) {
  std::size_t at = header_bytes(spec);
  for (const Vlr& vlr : spec.vlrs) at += 54 + vlr.content.size();
  return at;
}

// Every byte of a record but the coordinates is a different pattern, so a copy shows what it changed.
inline Bytes las_bytes(const LasSpec& spec) {
  Bytes b(points_offset(spec));
  const auto n = spec.xyz.size();
  const auto stride = record_bytes(spec);
  std::memcpy(b.data(), "LASF", 4);
  store(&b[6], static_cast<std::uint16_t>(spec.format >= 6 ? 0x10 : 0));
  b[24] = 1;
  b[25] = spec.minor;
  std::memcpy(&b[26], "by hand", 7);
  store(&b[94], static_cast<std::uint16_t>(header_bytes(spec)));
  store(&b[96], static_cast<std::uint32_t>(b.size()));
  store(&b[100], static_cast<std::uint32_t>(spec.vlrs.size()));
  b[104] = spec.format;
  store(&b[105], static_cast<std::uint16_t>(stride));
  if (spec.format < 6) store(&b[107], static_cast<std::uint32_t>(n));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    store(&b[131 + 8 * axis], spec.scale[axis]);
    store(&b[155 + 8 * axis], spec.offset[axis]);
    store(&b[179 + 16 * axis], 1e3);
    store(&b[187 + 16 * axis], -1e3);
  }
  if (spec.minor == 4) store(&b[247], static_cast<std::uint64_t>(n));

  std::size_t at = header_bytes(spec);
  const auto add_head = [&b](std::size_t to, const Vlr& vlr, bool extended) {
    std::memcpy(&b[to + 2], vlr.user.data(), vlr.user.size());
    store(&b[to + 18], vlr.id);
    if (extended)
      store(&b[to + 20], static_cast<std::uint64_t>(vlr.content.size()));
    else
      store(&b[to + 20], static_cast<std::uint16_t>(vlr.content.size()));
  };
  for (const Vlr& vlr : spec.vlrs) {
    add_head(at, vlr, false);
    std::copy(vlr.content.begin(), vlr.content.end(), b.begin() + static_cast<std::ptrdiff_t>(at) + 54);
    at += 54 + vlr.content.size();
  }
  for (std::size_t i = 0; i < n; ++i) {
    Bytes record(stride);
    for (std::size_t k = 0; k < stride; ++k) record[k] = static_cast<std::uint8_t>(37 * i + 11 * k + 5);
    for (std::size_t axis = 0; axis < 3; ++axis) store(&record[4 * axis], spec.xyz[i][axis]);
    b.insert(b.end(), record.begin(), record.end());
  }
  if (!spec.evlrs.empty()) {
    store(&b[235], static_cast<std::uint64_t>(b.size()));
    store(&b[243], static_cast<std::uint32_t>(spec.evlrs.size()));
    for (const Vlr& vlr : spec.evlrs) {
      const std::size_t to = b.size();
      b.resize(to + 60);
      add_head(to, vlr, true);
      b.insert(b.end(), vlr.content.begin(), vlr.content.end());
    }
  }
  return b;
}

inline LasSpec las_spec(std::uint8_t minor, std::uint8_t format) {
  LasSpec spec;
  spec.minor = minor;
  spec.format = format;
  return spec;
}

inline Bytes text_bytes(const std::string& text) { return {text.begin(), text.end()}; }

// A GeoTIFF key directory of keys whose values stand in it.
inline Vlr geokeys(const std::vector<std::array<std::uint16_t, 2>>& keys) {
  Vlr vlr{"LASF_Projection", 34735, Bytes(8 + 8 * keys.size())};
  store(&vlr.content[0], std::uint16_t{1});
  store(&vlr.content[2], std::uint16_t{1});
  store(&vlr.content[6], static_cast<std::uint16_t>(keys.size()));
  for (std::size_t i = 0; i < keys.size(); ++i) {
    store(&vlr.content[8 + 8 * i], keys[i][0]);
    store(&vlr.content[12 + 8 * i], std::uint16_t{1});
    store(&vlr.content[14 + 8 * i], keys[i][1]);
  }
  return vlr;
}

}  // namespace btms::test
