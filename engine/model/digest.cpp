#include "engine/model/digest.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace btms {

std::string Digest::hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t word : {high, low})
    for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(word >> shift) & 15];
  return text;
}

namespace {

// What is hashed: fields one after the other, little-endian without padding, whatever a compiler makes of a struct.
struct [[gnu::packed]] NodeRecord {
  NodeKey key;
  std::int32_t resolution_mm, centre_mm, first_mm, second_mm;
  std::uint8_t surface[sizeof(NodeSurface)];
};
struct [[gnu::packed]] UpperRecord {
  NodeKey key;
  std::int32_t resolution_mm, z_mm;
  std::int16_t slope_x, slope_y;
  std::uint16_t sd_mm, count;
  UpperKind kind;
};
static_assert(std::endian::native == std::endian::little);
static_assert(sizeof(NodeRecord) == 42 && sizeof(UpperRecord) == 25);
static_assert(std::has_unique_object_representations_v<NodeSurface> && sizeof(NodeSurface) == 18);

// Records are written to memory first and hashed later: a hash reads wide words, and would wait for narrow stores that
// have just been made.
template <class Record>
Digest hash_all(std::span<const Record> records) {
  Digest sum;
  for (const Record& record : records) {
    const XXH128_hash_t h = XXH3_128bits(&record, sizeof record);
    sum += {h.low64, h.high64};
  }
  return sum;
}

// Nodes with anything to say, row by row.
Digest hash_nodes(const TerrainTile& tile) {
  const auto cols = static_cast<std::size_t>(tile.box.cols());
  std::vector<NodeRecord> records(cols * kTriangles);
  Digest sum;
  for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row) {
    const Cell west{tile.box.col0, row};
    const NodeSurface* node = tile.nodes.data() + tile.node_index({west, 0});
    const std::int32_t* centre = tile.centre_mm.data() + tile.cell_index(west);
    const std::int32_t* south = tile.corner_mm.data() + tile.corner_index(west);
    const std::int32_t* north = south + cols + 1;
    NodeKey key = node_key({west, 0});
    NodeRecord* to = records.data();
    const auto add = [&](std::int32_t centre_mm, std::int32_t first_mm, std::int32_t second_mm) {
      // A node without a plane has no corners of its own; those of its neighbours are counted with them.
      const bool known = node->state != NodeState::kUnknown;
      to->key = key++;
      to->resolution_mm = tile.resolution_mm;
      to->centre_mm = known ? centre_mm : kUnknownHeight_mm;
      to->first_mm = known ? first_mm : kUnknownHeight_mm;
      to->second_mm = known ? second_mm : kUnknownHeight_mm;
      std::memcpy(to->surface, node, sizeof *node);
      to += *node++ != NodeSurface{};
    };
    for (std::size_t i = 0; i < cols; ++i) {
      const std::int32_t a = south[i], b = south[i + 1], c = north[i + 1], d = north[i];
      add(centre[i], b, c);
      add(centre[i], c, d);
      add(centre[i], d, a);
      add(centre[i], a, b);
    }
    sum += hash_all(std::span<const NodeRecord>(records.data(), to));
  }
  return sum;
}

Digest hash_upper(const TerrainTile& tile) {
  std::vector<UpperRecord> records;
  records.reserve(tile.upper.size());
  const auto cols = static_cast<std::uint32_t>(tile.box.cols());
  for (const UpperNode& u : tile.upper) {
    const std::uint32_t cell = u.node / kTriangles;
    const NodeId id{{tile.box.col0 + static_cast<std::int32_t>(cell % cols),
                     tile.box.row0 + static_cast<std::int32_t>(cell / cols)},
                    static_cast<std::uint8_t>(u.node % kTriangles)};
    records.push_back({node_key(id), tile.resolution_mm, u.z_mm, u.slope_x, u.slope_y, u.sd_mm, u.count, u.kind});
  }
  return hash_all(std::span<const UpperRecord>(records));
}

}  // namespace

Digest digest(const TerrainTile& tile) {
  Digest sum = hash_nodes(tile);
  sum += hash_upper(tile);
  return sum;
}

}  // namespace btms
