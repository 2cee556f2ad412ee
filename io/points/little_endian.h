// Numbers in the files' byte order. Every format here is little-endian, as is every machine the engine runs on.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace btms {

static_assert(std::endian::native == std::endian::little);

template <typename T>
T load(const std::uint8_t* from) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

template <typename T>
void store(std::uint8_t* to, T value) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::memcpy(to, &value, sizeof value);
}

}  // namespace btms
