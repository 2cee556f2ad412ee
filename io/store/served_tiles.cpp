#include "io/store/served_tiles.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>

#include "io/store/hash.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Two hashes of unlike seeds, chained: 128 bits that no two contents share by accident.
constexpr std::uint64_t kHighSeed = 0x9E3779B97F4A7C15ull;
void chain(TilePrint& print, std::span<const std::uint8_t> bytes) {
  print.low = xxh3_64(bytes, print.low);
  print.high = xxh3_64(bytes, print.high ^ kHighSeed);
}

// The tiles of the level that sample squares of the box.
CellBox tiles_over(const CellBox& fine, int level) {
  const std::int64_t edge = std::int64_t{kServedCells} << level;
  const auto first = [&](std::int32_t n) { return static_cast<std::int32_t>(floor_div(n, edge)); };
  const auto end = [&](std::int32_t n) { return static_cast<std::int32_t>(ceil_div(n, edge)); };
  return {first(fine.col0), first(fine.row0), end(fine.col1), end(fine.row1)};
}

}  // namespace

ServedTiles::ServedTiles(const Manifest& manifest) : r_m_(manifest.info.layout.lattice.resolution_m()) {
  for (const ShardEntry& shard : manifest.shards) bounds_ = bounds_.hull(shard.bounds());
  // What a GeoTIFF says is part of its content, too.
  frame_print_ = static_cast<std::uint64_t>(manifest.info.layout.lattice.resolution_mm());
  if (const std::string& crs = manifest.info.crs_wkt; !crs.empty()) frame_print_ ^= xxh3_64(bytes_of(crs));
  for (int level = 0; !bounds_.empty(); ++level) {
    Level& of = levels_.emplace_back();
    of.cell_m = std::ldexp(r_m_, level);
    of.extent = tiles_over(bounds_, level);
    for (const ShardEntry& shard : manifest.shards) {
      const CellBox bounds = shard.bounds(), tiles = tiles_over(bounds, level);
      const std::uint64_t revision = shard_revision(shard.file).value_or(manifest.info.revision);
      const std::int64_t words[] = {bounds.col0, bounds.row0, bounds.col1, bounds.row1,
                                    static_cast<std::int64_t>(shard.values_xxh3)};
      for (std::int32_t ty = tiles.row0; ty < tiles.row1; ++ty)
        for (std::int32_t tx = tiles.col0; tx < tiles.col1; ++tx) {
          ServedTile& tile = of.tiles[{tx, ty}];
          chain(tile.content, {reinterpret_cast<const std::uint8_t*>(words), sizeof words});
          tile.revision = std::max(tile.revision, revision);
        }
    }
    if (of.extent.cols() <= 2 && of.extent.rows() <= 2) break;
  }
}

const ServedTile* ServedTiles::find(int level, TileId id) const {
  if (level < 0 || static_cast<std::size_t>(level) >= levels_.size()) return nullptr;
  const auto& tiles = levels_[static_cast<std::size_t>(level)].tiles;
  const auto it = tiles.find(id);
  return it == tiles.end() ? nullptr : &it->second;
}

bool ServedTiles::inside(int level, TileId id) const {
  return level >= 0 && static_cast<std::size_t>(level) < levels_.size() &&
         levels_[static_cast<std::size_t>(level)].extent.contains({id.tx, id.ty});
}

CellBox ServedTiles::box_of(TileId id) { return TileGrid{kServedCells, {}}.box_of(id); }

std::array<double, 4> ServedTiles::bounds_m(int level, TileId id) const {
  const double edge_m = std::ldexp(r_m_ * kServedCells, level);
  return {id.tx * edge_m, id.ty * edge_m, (id.tx + 1.0) * edge_m, (id.ty + 1.0) * edge_m};
}

std::array<double, 4> ServedTiles::bounds_m() const {
  return {bounds_.col0 * r_m_, bounds_.row0 * r_m_, bounds_.col1 * r_m_, bounds_.row1 * r_m_};
}

std::string ServedTiles::etag(int level, TileId id, std::string_view form) const {
  const ServedTile* tile = find(level, id);
  TilePrint print = tile ? tile->content : TilePrint{};
  const std::int64_t words[] = {level, id.tx, id.ty, tile != nullptr, static_cast<std::int64_t>(frame_print_)};
  chain(print, {reinterpret_cast<const std::uint8_t*>(words), sizeof words});
  chain(print, bytes_of(form));
  return "xxh3:" + hex64(print.high) + hex64(print.low);
}

std::string served_id(int level, TileId id) {
  return std::to_string(level).append("/").append(std::to_string(id.tx)).append("/").append(std::to_string(id.ty));
}

std::optional<std::pair<int, TileId>> parse_served_id(std::string_view text) {
  std::array<std::int32_t, 3> parts{};
  const char *at = text.data(), *end = text.data() + text.size();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0 && (at == end || *at++ != '/')) return {};
    const auto [next, error] = std::from_chars(at, end, parts[i]);
    if (error != std::errc()) return {};
    at = next;
  }
  if (at != end) return {};
  const TileId id{parts[1], parts[2]};
  if (served_id(parts[0], id) != text) return {};
  return std::pair(static_cast<int>(parts[0]), id);
}

}  // namespace btms
