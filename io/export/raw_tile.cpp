#include "io/export/raw_tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "engine/error.h"
#include "io/store/hash.h"

namespace btms {
namespace {

static_assert(std::endian::native == std::endian::little, "raw tiles are little-endian");

constexpr char kMagic[] = {'B', 'T', 'M', 'S', 'T', 'I', 'L', 'E'};
constexpr std::uint16_t kVersion = 1, kFloat32 = 1, kFloat32Chunk = 2, kByteChunk = 3;

// The header as it lies in the file.
struct Stored {
  char magic[8] = {};
  std::uint16_t version = kVersion, layers = 0, type = kFloat32, level = 0;
  std::int32_t tx = 0, ty = 0;
  std::uint32_t rows = 0, cols = 0;
  double min_x_m = 0, min_y_m = 0, cell_m = 0;
  std::uint64_t xxh3 = 0;
};
static_assert(sizeof(Stored) == kRawHeader_bytes);

[[noreturn]] void bad(const char* why) { throw Error(ErrorCode::kBadInput, std::string("not a raw tile: ") + why); }

}  // namespace

std::vector<std::uint8_t> raw_tile(const Window& window, TileId id) {
  const std::size_t layer_bytes = window.rows * window.cols * sizeof(float);
  std::vector<std::uint8_t> bytes(kRawHeader_bytes + window.values.size() * layer_bytes);
  std::uint8_t* to = bytes.data() + kRawHeader_bytes;
  for (const std::vector<float>& layer : window.values) {
    std::memcpy(to, layer.data(), layer_bytes);
    to += layer_bytes;
  }
  Stored header;
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.layers = static_cast<std::uint16_t>(window.values.size());
  header.level = static_cast<std::uint16_t>(window.level);
  header.tx = id.tx;
  header.ty = id.ty;
  header.rows = static_cast<std::uint32_t>(window.rows);
  header.cols = static_cast<std::uint32_t>(window.cols);
  header.min_x_m = window.min_x_m;
  header.min_y_m = window.min_y_m;
  header.cell_m = window.cell_m;
  header.xxh3 = xxh3_64(std::span(bytes).subspan(kRawHeader_bytes));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

std::vector<std::uint8_t> chunk_tile(const StoredRaster& raster, TileId id, double cell_m) {
  Stored header;
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.layers = 1;
  header.type = raster.element_bytes == 1 ? kByteChunk : kFloat32Chunk;
  header.tx = id.tx;
  header.ty = id.ty;
  header.rows = static_cast<std::uint32_t>(raster.box.rows());
  header.cols = static_cast<std::uint32_t>(raster.box.cols());
  header.min_x_m = raster.box.col0 * cell_m;
  header.min_y_m = raster.box.row0 * cell_m;
  header.cell_m = cell_m;
  header.xxh3 = xxh3_64(raster.bytes);
  std::vector<std::uint8_t> bytes(sizeof header + raster.bytes.size());
  std::memcpy(bytes.data(), &header, sizeof header);
  std::copy(raster.bytes.begin(), raster.bytes.end(), bytes.begin() + sizeof header);
  return bytes;
}

RawHeader parse_raw_tile(std::span<const std::uint8_t> bytes) {
  Stored h;
  if (bytes.size() < sizeof h) bad("shorter than its header");
  std::memcpy(&h, bytes.data(), sizeof h);
  if (std::memcmp(h.magic, kMagic, sizeof kMagic) != 0) bad("it begins otherwise");
  if (h.version != kVersion || h.type != kFloat32) bad("another version");
  if (h.layers == 0 || h.rows == 0 || h.cols == 0 || h.level > kMaxLevel) bad("it is empty");
  // Each factor is below 2^32: the products below can't overflow.
  const std::uint64_t squares = std::uint64_t{h.rows} * h.cols;
  if (squares > static_cast<std::uint64_t>(kMaxWindowSquares) ||
      bytes.size() != sizeof h + squares * h.layers * sizeof(float))
    bad("its length does not fit its header");
  if (!std::isfinite(h.min_x_m) || !std::isfinite(h.min_y_m) || !std::isfinite(h.cell_m) || !(h.cell_m > 0))
    bad("it lies nowhere");
  if (xxh3_64(bytes.subspan(sizeof h)) != h.xxh3)
    throw Error(ErrorCode::kVerification, "a raw tile's values differ from its hash");
  return {h.layers, h.level, h.tx, h.ty, h.rows, h.cols, h.min_x_m, h.min_y_m, h.cell_m, h.xxh3};
}

}  // namespace btms
