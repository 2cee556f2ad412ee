#include "io/points/metres.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "io/points/little_endian.h"

namespace btms {
namespace {

template <typename T>
T load_swapped(const std::uint8_t* from) {
  std::uint8_t bytes[sizeof(T)];
  std::reverse_copy(from, from + sizeof(T), bytes);
  return load<T>(bytes);
}

template <typename T>
void spread(double* to, const std::uint8_t* from, std::size_t stride, std::size_t n, bool big_endian) {
  if (big_endian)
    for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<double>(load_swapped<T>(from + i * stride));
  else
    for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<double>(load<T>(from + i * stride));
}

}  // namespace

void Metres::unpack(std::size_t to, const std::uint8_t* from, std::size_t stride, NumberType type, std::size_t n,
                    bool big_endian) {
  using Spread = void (*)(double*, const std::uint8_t*, std::size_t, std::size_t, bool);
  constexpr Spread kSpread[] = {spread<std::int8_t>,   spread<std::uint8_t>, spread<std::int16_t>,
                                spread<std::uint16_t>, spread<std::int32_t>, spread<std::uint32_t>,
                                spread<float>,         spread<double>};
  kSpread[static_cast<std::size_t>(type)](axis[to], from, stride, n, big_endian);
}

void read_lines(const PointLines& lines, const InputFile& file, std::uint64_t first, std::size_t count,
                PointBlock& block) {
  Metres chunk;
  std::size_t n = 0, done = 0;
  const auto round = [&] {
    chunk.round(n, block, done);
    done += std::exchange(n, 0);
  };
  lines.read(file, first, count, block.bytes, [&](const double* xyz) {
    for (std::size_t axis = 0; axis < 3; ++axis) chunk.axis[axis][n] = xyz[axis];
    if (++n == kMmChunk) round();
  });
  round();
}

void warn_of_coarse_floats(const PointFile& file, std::vector<std::string>& warnings) {
  constexpr std::int64_t kFar_mm = 100'000'000;
  PointBlock block;
  file.read(0, std::min<std::uint64_t>(file.size(), 1024), block);
  for (std::size_t i = 0; i < block.size(); ++i) {
    const bool dropped = block.x_mm[i] == PointBlock::kDroppedX;
    if (dropped || (std::abs(block.x_mm[i]) <= kFar_mm && std::abs(block.y_mm[i]) <= kFar_mm)) continue;
    warnings.emplace_back(
        "coordinates beyond 100 km as float32 have lost their precision (steps of 8 mm to 0.5 m); write them as "
        "float64, or relative to a local origin");
    return;
  }
}

}  // namespace btms
