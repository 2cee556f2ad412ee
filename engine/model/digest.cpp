#include "engine/model/digest.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cstring>

namespace btms {

std::string Digest::hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t word : {high, low})
    for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(word >> shift) & 15];
  return text;
}

Digest digest(const TerrainTile& tile) {
  // Key, resolution, corners, fields, little-endian without padding.
  struct Record {
    NodeKey key;
    std::int32_t resolution_mm;
    std::array<std::int32_t, 3> corners_mm;
    NodeSurface surface;
  };
  constexpr std::array<std::int32_t, 3> kNoCorners = {kUnknownHeight_mm, kUnknownHeight_mm, kUnknownHeight_mm};
  static_assert(sizeof(Record) == 32 && sizeof(NodeSurface) == 8);

  Digest sum;
  for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row)
    for (std::int32_t col = tile.box.col0; col < tile.box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        const NodeSurface& surface = tile.nodes[tile.node_index(id)];
        if (surface == NodeSurface{}) continue;
        // A node without a plane has no corners of its own; those of its neighbours are counted with them.
        const bool plane = surface.state != NodeState::kUnknown;
        const Record record{node_key(id), tile.resolution_mm, plane ? tile.corners_mm(id) : kNoCorners, surface};
        const XXH128_hash_t h = XXH3_128bits(&record, sizeof record);
        sum += Digest{h.low64, h.high64};
      }
  return sum;
}

}  // namespace btms
