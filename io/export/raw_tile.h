// The raw form of a window: what programs read. 64 bytes of header, then every layer as float32, little-endian, rows
// from north to south, NaN where there is nothing. docs/http_api.md has the table.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/export/raster.h"
#include "io/store/map_store.h"

namespace btms {

inline constexpr std::size_t kRawHeader_bytes = 64;

struct RawHeader {
  std::uint16_t layers = 0, level = 0;
  std::int32_t tx = 0, ty = 0;  // of a served tile
  std::uint32_t rows = 0, cols = 0;
  double min_x_m = 0, min_y_m = 0, cell_m = 0;  // south-west corner
  std::uint64_t xxh3 = 0;                       // XXH3-64 of what follows the header
};

std::vector<std::uint8_t> raw_tile(const Window& window, TileId id);
// The chunk form: the same header (type 2: float32, 3: u8; rows, columns and corner of what is stored, one layer), then
// the stored bytes. `cell_m`: edge of a square.
std::vector<std::uint8_t> chunk_tile(const StoredRaster& raster, TileId id, double cell_m);
// Throws Error(kBadInput) for anything that is not a raw tile of just these lengths, Error(kVerification) when the hash
// is another.
RawHeader parse_raw_tile(std::span<const std::uint8_t> bytes);

}  // namespace btms
