// Tiles with noise in every field that is consistent across borders, and folders to put maps in.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

#include "engine/error.h"
#include "io/store/map_store.h"

namespace btms {

// A number that depends on the arguments alone.
inline std::uint64_t noise(std::int64_t a, std::int64_t b, std::uint64_t salt) {
  std::uint64_t h = static_cast<std::uint64_t>(a) * 0x9E3779B97F4A7C15ull ^
                    static_cast<std::uint64_t>(b) * 0xC2B2AE3D27D4EB4Full ^ salt * 0x165667B19E3779F9ull;
  h ^= h >> 29;
  h *= 0xBF58476D1CE4E5B9ull;
  return h ^ h >> 32;
}

// Full range of every field, unknown places included; a corner has the same height in every tile that holds it.
inline TerrainTile noisy_tile(const MapLayout& layout, const CellBox& box) {
  TerrainTile tile(layout.lattice.resolution_mm(), box);
  const auto height = [](std::int32_t col, std::int32_t row, std::uint64_t salt) {
    const std::uint64_t n = noise(col, row, salt);
    return n % 7 == 0 ? kUnknownHeight_mm : static_cast<std::int32_t>(n % (1u << 28)) - (1 << 27);
  };
  for (std::int32_t row = box.row0; row <= box.row1; ++row)
    for (std::int32_t col = box.col0; col <= box.col1; ++col) {
      tile.corner_mm[tile.corner_index({col, row})] = height(col, row, 1);
      if (row == box.row1 || col == box.col1) continue;
      const std::size_t cell = tile.cell_index({col, row});
      tile.centre_mm[cell] = height(col, row, 2);
      for (std::uint64_t t = 0; t < kTriangles; ++t) {
        const std::uint64_t n = noise(col, row, 3 + t);
        const std::uint64_t m = noise(col, row, 7 + t), k = noise(col, row, 11 + t);
        const auto u8 = [](std::uint64_t v) { return static_cast<std::uint8_t>(v); };
        const auto u16 = [](std::uint64_t v) { return static_cast<std::uint16_t>(v); };
        tile.nodes[cell * kTriangles + t] = {NodeState{u8(n % 5)}, u8(n >> 2),  u16(n >> 10),     u16(n >> 26),
                                             u16(n >> 42),         u16(m),      u16(m >> 16),     u16(m >> 32),
                                             u16(m >> 48),         u8(k >> 16), u8((k >> 24) % 6)};
        // None, one or a few further surfaces, two of them at one height now and then.
        for (std::uint64_t i = 0; i < k % 37 % 4; ++i)
          tile.upper.push_back({static_cast<std::uint32_t>(cell * kTriangles + t),
                                static_cast<std::int32_t>(i / 2 * 1000) - (1 << 27), static_cast<std::int16_t>(k >> 32),
                                static_cast<std::int16_t>(m >> 8), u16(n >> 5), u16(i),
                                k % 2 == 0 ? UpperKind::kReachable : UpperKind::kDetached});
      }
    }
  return tile;
}

// Gentle hills, all observed but for a pond without anything and a predicted strip with an obstacle on it.
inline TerrainTile hilly_tile(const MapLayout& layout, const CellBox& box) {
  TerrainTile tile(layout.lattice.resolution_mm(), box);
  const double r_m = layout.lattice.resolution_m();
  const auto height = [&](double col, double row) {
    const double x = col * r_m / 90, y = row * r_m / 70;
    return static_cast<std::int32_t>(
        1000 * (20 + 8 * std::sin(x) * std::cos(y) + 3 * std::sin(2.3 * x + y) + 0.01 * row * r_m));
  };
  const auto in_pond = [](std::int32_t col, std::int32_t row) { return noise(col >> 4, row >> 4, 9) % 17 == 0; };
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) {
      if (in_pond(col, row)) continue;
      const std::size_t cell = tile.cell_index({col, row});
      tile.centre_mm[cell] = height(col + 0.5, row + 0.5);
      for (const Cell c : {Cell{col, row}, Cell{col + 1, row}, Cell{col, row + 1}, Cell{col + 1, row + 1}})
        tile.corner_mm[tile.corner_index(c)] = height(c.col, c.row);
      const bool strip = (col & 31) > 22, house = strip && (col & 31) > 25 && (row & 15) < 9;
      for (std::size_t t = 0; t < kTriangles; ++t)
        tile.nodes[cell * kTriangles + t] = {house   ? NodeState::kObstacle
                                             : strip ? NodeState::kPredicted
                                                     : NodeState::kObserved,
                                             200, static_cast<std::uint16_t>(strip ? 0 : 40),
                                             static_cast<std::uint16_t>(strip ? 300 : 0), 12};
    }
  // Borders: a neighbour may know a corner this tile has no triangle at; corners agree everywhere.
  for (std::int32_t row = box.row0; row <= box.row1; ++row)
    for (std::int32_t col = box.col0; col <= box.col1; ++col)
      if (!in_pond(col, row) || !in_pond(col - 1, row) || !in_pond(col, row - 1) || !in_pond(col - 1, row - 1))
        tile.corner_mm[tile.corner_index({col, row})] = height(col, row);
  return tile;
}

inline MapLayout layout_of(std::int32_t r_mm, std::int32_t edge, Cell origin = {}) {
  return {Lattice(r_mm), {edge, origin}};
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "btms-store-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

using Tiles = std::map<TileId, TerrainTile>;

// Writes and publishes a map of these tiles.
inline void write_map(const std::filesystem::path& folder, const MapLayout& layout, const Tiles& tiles,
                      const std::string& crs = {}) {
  const auto writer = MapWriter::create(folder, layout, {.crs = crs});
  for (const auto& [id, tile] : tiles) writer->put(id, TerrainTile(tile));
  const auto entries = writer->finish();
  MapInfo info;
  info.inputs = {{"made.las", 5, 100}};
  writer->publish(info, {entries});
}

// The tiles of `cells`, each cropped to it.
template <class Make>
Tiles made_tiles(const MapLayout& layout, const CellBox& cells, Make&& make) {
  Tiles tiles;
  layout.grid.for_each_tile(
      cells, [&](TileId id) { tiles.emplace(id, make(layout, layout.grid.box_of(id).intersect(cells))); });
  return tiles;
}

inline std::string file_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}
inline std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& e : std::filesystem::directory_iterator(folder)) files.push_back(e.path());
  std::sort(files.begin(), files.end());
  return files;
}

// The code of the Error that fn throws; fails the test when it throws none.
template <class Fn>
ErrorCode thrown_code(Fn&& fn) {
  try {
    fn();
  } catch (const Error& e) {
    return e.code();
  }
  ADD_FAILURE() << "no Error thrown";
  return ErrorCode::kCancelled;
}

}  // namespace btms
