// The tiles a map is served in: squares of 128 x 128 cells on every level, whatever the tiles it is stored in. What
// exists, its identity by content, and the revision that last changed it all follow from the manifest alone.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "io/store/manifest.h"

namespace btms {

inline constexpr std::int32_t kServedCells = 128;

// Of the decoded values below a tile; equal values have equal prints, whatever file they are in.
struct TilePrint {
  std::uint64_t low = 0, high = 0;
  friend bool operator==(const TilePrint&, const TilePrint&) = default;
};

struct ServedTile {
  TilePrint content;
  std::uint64_t revision = 0;  // that last changed it
};

// Immutable, thread-safe.
class ServedTiles {
 public:
  explicit ServedTiles(const Manifest& manifest);

  struct Level {
    double cell_m = 0;
    CellBox extent;  // in tiles: columns and rows from the first that exists to the last
    std::unordered_map<TileId, ServedTile, TileIdHash> tiles;
  };
  // Finest first; the last has the whole map in at most 2 x 2 tiles.
  std::span<const Level> levels() const { return levels_; }
  // nullptr where nothing of the map is below.
  const ServedTile* find(int level, TileId id) const;
  // What is asked for and is not there: inside the extent of the level's tiles (empty), or beyond it.
  bool inside(int level, TileId id) const;
  // The box of a tile in squares of its level, and in metres: min x, min y, max x, max y.
  static CellBox box_of(TileId id);
  std::array<double, 4> bounds_m(int level, TileId id) const;
  // Of all that exists, in metres.
  std::array<double, 4> bounds_m() const;
  // The strong validator of a tile's answer: xxh3:<32 hex digits>, of content, place and `form`: layers and format.
  // Of a tile without content, too.
  std::string etag(int level, TileId id, std::string_view form) const;

 private:
  std::vector<Level> levels_;
  CellBox bounds_;
  double r_m_ = 0;
  std::uint64_t frame_print_ = 0;  // edge of a square and reference system
};

// "level/tx/ty", and back: nothing for any other text.
std::string served_id(int level, TileId id);
std::optional<std::pair<int, TileId>> parse_served_id(std::string_view text);

}  // namespace btms
