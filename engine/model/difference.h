// How two terrain models differ, node by node, in the terms of the digest: two models without a difference have the
// same digest, whatever their tiles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/model/terrain_tile.h"

namespace btms {

enum class CompareLayer : std::uint8_t {
  kHeight,  // of the node's three corners, the greatest difference
  kWeight,
  kCount,
  kSupport,
  kSd,
  kTerrain,
  kRoughness,
  kStep,
  kClearance,
  kCost,
  kSourceLevel,
  kUpper,  // further surfaces over the node: their heights, where both have as many
};
inline constexpr std::size_t kCompareLayers = 12, kStates = 5;

// In stored units: millimetres, 1/255 and so on.
struct LayerDifference {
  std::uint64_t nodes = 0;     // that differ
  std::uint64_t measured = 0;  // of those, with a value on both sides
  std::uint64_t sum = 0;       // of the absolute differences of these
  std::uint64_t most = 0;
};

struct Difference {
  std::uint64_t nodes = 0;                             // with anything in them, on either side
  std::uint64_t differ = 0;                            // in anything
  std::array<LayerDifference, kCompareLayers> layers;  // of nodes with a surface on both sides; kCount of all
  std::array<std::array<std::uint64_t, kStates>, kStates> states{};  // [before][after] of all `nodes`

  Difference& operator+=(const Difference& o);
};

// Of the squares inside `region`. nullptr is a tile without anything; both have the same resolution.
Difference difference(const TerrainTile* before, const TerrainTile* after, const CellBox& region);

}  // namespace btms
