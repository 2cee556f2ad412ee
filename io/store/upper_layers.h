// The further surfaces of a shard as lists: CF's "compression by gathering". Each names the triangle below it by its
// place in a raster (tri, y, x), row 0 in the north; a list ascends by that place, then by height.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/store/layers.h"

namespace btms {

// One further surface, `node` counted in the raster.
using ListedUpper = UpperNode;

// Over one node: storeys of a tower of 380 m, and far beyond what is ever scanned. Bounds what a reader allocates.
inline constexpr std::size_t kMaxUpperPerNode = 128;

// Whether a tile's list is what TerrainTile says: nodes it has, at most kMaxUpperPerNode times each, ascending by
// (node, z_mm), kinds there are.
bool is_sound_list(std::span<const UpperNode> upper, const CellBox& box);

// The same of the places alone: the values of the layer tgf/upper, as stored.
bool are_sound_places(std::span<const std::uint8_t> values, const CellBox& box);

// From the tile's order to the raster's. Precondition: is_sound_list().
std::vector<ListedUpper> list_upper(const TerrainTile& tile);
// The way back. Throws Error(kVerification) for a list that list_upper() can't have made.
std::vector<UpperNode> unlist_upper(std::vector<ListedUpper>&& listed, const CellBox& box);

// One list layer, little-endian, and back. Precondition: layer.raster is kPerUpper; the sizes fit.
std::vector<std::uint8_t> gather_upper(const LayerInfo& layer, std::span<const ListedUpper> listed);
void scatter_upper(const LayerInfo& layer, std::span<const std::uint8_t> values, std::span<ListedUpper> listed);

}  // namespace btms
