// Records of a RoundMemory: lists of plain values over the cells of a tile.
#pragma once

#include <cstring>
#include <optional>
#include <type_traits>
#include <vector>

#include "engine/lattice/tiles.h"

namespace btms {

// One record: the box of cells it is about, then the lists.
template <class... T>
std::vector<std::uint8_t> pack_record(const CellBox& box, const std::vector<T>&... lists) {
  static_assert((std::is_trivially_copyable_v<T> && ...));
  std::vector<std::uint8_t> out;
  const auto put = [&](const void* from, std::size_t bytes) {
    const std::size_t at = out.size();
    out.resize(at + bytes);
    std::memcpy(out.data() + at, from, bytes);
  };
  put(&box, sizeof box);
  const auto put_list = [&](const auto& list) {
    const std::uint64_t n = list.size();
    put(&n, sizeof n);
    if (n > 0) put(list.data(), n * sizeof list[0]);
  };
  (put_list(lists), ...);
  return out;
}

// False when there is no record, or it is one of other cells.
template <class... T>
bool unpack_record(const std::optional<std::vector<std::uint8_t>>& record, const CellBox& box,
                   std::vector<T>&... lists) {
  std::size_t at = 0;
  const auto take = [&](void* to, std::size_t bytes) {
    if (bytes > record->size() - at) return false;
    if (bytes > 0) std::memcpy(to, record->data() + at, bytes);
    at += bytes;
    return true;
  };
  const auto take_list = [&](auto& list) {
    std::uint64_t n = 0;
    if (!take(&n, sizeof n) || n > (record->size() - at) / sizeof list[0]) return false;
    list.resize(n);
    return take(list.data(), n * sizeof list[0]);
  };
  CellBox of;
  return record && take(&of, sizeof of) && of == box && (take_list(lists) && ...) && at == record->size();
}

// Of which cells a record is.
inline CellBox record_box(const std::vector<std::uint8_t>& record) {
  CellBox box;
  if (record.size() >= sizeof box) std::memcpy(&box, record.data(), sizeof box);
  return box;
}

}  // namespace btms
