// PCD files made by hand.
#pragma once

#include "tests/io/points/lzf_bytes.h"

namespace btms::test {

inline std::string pcd_header(const std::string& data, std::size_t points, const std::string& fields = "x y z",
                              const std::string& size = "4 4 4", const std::string& type = "F F F",
                              const std::string& count = "1 1 1") {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + size + "\nTYPE " +
         type + "\nCOUNT " + count + "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " +
         data + "\n";
}

inline Bytes operator+(const std::string& header, const Bytes& data) {
  Bytes bytes(header.begin(), header.end());
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

template <typename T>
void append(Bytes& bytes, T value) {
  bytes.resize(bytes.size() + sizeof value);
  store(&bytes[bytes.size() - sizeof value], value);
}

// Sizes and packed bytes, as DATA binary_compressed wants them.
inline Bytes compressed(const Bytes& columns, std::size_t trailing_bytes = 0) {
  const Bytes packed = lzf_compress(columns);
  Bytes bytes;
  append(bytes, static_cast<std::uint32_t>(packed.size()));
  append(bytes, static_cast<std::uint32_t>(columns.size()));
  bytes.insert(bytes.end(), packed.begin(), packed.end());
  bytes.resize(bytes.size() + trailing_bytes);
  return bytes;
}

}  // namespace btms::test
