#include "engine/model/digest.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cstring>
#include <type_traits>

namespace btms {

std::string Digest::hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t word : {high, low})
    for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(word >> shift) & 15];
  return text;
}

namespace {

// Fields one after the other, little-endian without padding: what is hashed does not depend on a compiler's layout.
class Bytes {
 public:
  template <class T>
  Bytes& operator<<(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    std::memcpy(bytes_.data() + size_, &value, sizeof value);
    size_ += sizeof value;
    return *this;
  }
  Digest hash() const {
    const XXH128_hash_t h = XXH3_128bits(bytes_.data(), size_);
    return {h.low64, h.high64};
  }

 private:
  std::array<std::uint8_t, 64> bytes_;
  std::size_t size_ = 0;
};

Bytes& operator<<(Bytes& out, const NodeSurface& n) {
  return out << n.state << n.weight << n.count << n.support << n.sd_mm << n.terrain_mm << n.roughness_mm << n.step_mm
             << n.clearance_mm << n.cost << n.source_level;
}

}  // namespace

Digest digest(const TerrainTile& tile) {
  constexpr std::array<std::int32_t, 3> kNoCorners = {kUnknownHeight_mm, kUnknownHeight_mm, kUnknownHeight_mm};
  Digest sum;
  auto upper = tile.upper.begin();
  for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row)
    for (std::int32_t col = tile.box.col0; col < tile.box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        const std::size_t index = tile.node_index(id);
        for (; upper != tile.upper.end() && upper->node == index; ++upper)
          sum += (Bytes() << node_key(id) << tile.resolution_mm << upper->z_mm << upper->slope_x << upper->slope_y
                          << upper->sd_mm << upper->count << upper->kind)
                     .hash();
        const NodeSurface& surface = tile.nodes[index];
        if (surface == NodeSurface{}) continue;
        // A node without a plane has no corners of its own; those of its neighbours are counted with them.
        const auto corners = surface.state != NodeState::kUnknown ? tile.corners_mm(id) : kNoCorners;
        sum +=
            (Bytes() << node_key(id) << tile.resolution_mm << corners[0] << corners[1] << corners[2] << surface).hash();
      }
  return sum;
}

}  // namespace btms
