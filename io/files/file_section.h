// A part of a file that is written from its begin to its end while others are written beside it.
#pragma once

#include <cstring>
#include <type_traits>
#include <vector>

#include "io/files/atomic_file.h"

namespace btms {

class FileSection {
 public:
  FileSection(AtomicFile& file, std::uint64_t offset) : file_(file), offset_(offset) { bytes_.reserve(kBuffer_bytes); }

  std::uint64_t end() const { return offset_ + bytes_.size(); }  // offset of what comes next
  void put(std::span<const std::uint8_t> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    if (bytes_.size() >= kBuffer_bytes) flush();
  }
  void put(std::string_view text) { put(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())); }
  // Little-endian, as the machine is (io/points/little_endian.h).
  template <class... T>
  requires(std::is_arithmetic_v<T>&&...) void put(T... values) {
    std::uint8_t record[(sizeof(T) + ...)];
    std::uint8_t* at = record;
    ((std::memcpy(at, &values, sizeof values), at += sizeof values), ...);
    put(std::span<const std::uint8_t>(record));
  }
  void flush() {
    file_.write(offset_, bytes_);
    offset_ += bytes_.size();
    bytes_.clear();
  }

 private:
  static constexpr std::size_t kBuffer_bytes = std::size_t{1} << 18;
  AtomicFile& file_;
  std::uint64_t offset_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace btms
