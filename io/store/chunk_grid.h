// Rasters cut into chunks of equal shape; chunks that reach over the edge are filled up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "io/store/hdf5.h"
#include "io/store/layers.h"

namespace btms {

// Copies between a raster and one chunk, row by row: copy(raster bytes, chunk bytes, length) for the part both cover.
template <class Copy>
void each_chunk_row(const LayerShape& raster, const LayerShape& chunk, std::size_t row0, std::size_t col0,
                    std::size_t element, Copy&& copy) {
  const std::size_t rows = std::min(chunk.rows, raster.rows - row0), cols = std::min(chunk.cols, raster.cols - col0);
  for (std::size_t plane = 0; plane < raster.planes; ++plane)
    for (std::size_t row = 0; row < rows; ++row)
      copy(((plane * raster.rows + row0 + row) * raster.cols + col0) * element,
           (plane * chunk.rows + row) * chunk.cols * element, cols * element);
}

// Calls fn(row0, col0) for every chunk.
template <class Fn>
void each_chunk(const LayerShape& raster, const LayerShape& chunk, Fn&& fn) {
  for (std::size_t row0 = 0; row0 < raster.rows; row0 += chunk.rows)
    for (std::size_t col0 = 0; col0 < raster.cols; col0 += chunk.cols) fn(row0, col0);
}

// Where HDF5 has the chunk.
inline std::array<hsize_t, 3> chunk_offset(const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  if (layer.raster == Raster::kPerTriangle) return {0, row0, col0};
  if (layer.raster == Raster::kPerUpper) return {col0, 0, 0};
  return {row0, col0, 0};
}

// `bytes` filled with copies of `value`; doubling what is there beats copying single elements.
inline void fill_with(std::span<std::uint8_t> bytes, std::span<const std::uint8_t> value) {
  std::size_t done = std::min(value.size(), bytes.size());
  std::memcpy(bytes.data(), value.data(), done);
  for (; done < bytes.size(); done += std::min(done, bytes.size() - done))
    std::memcpy(bytes.data() + done, bytes.data(), std::min(done, bytes.size() - done));
}

}  // namespace btms
