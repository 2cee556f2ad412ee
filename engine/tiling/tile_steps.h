// What passes do on one tile: the passes run these over all tiles, ScanSegmenter over its only one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/terrain_tile.h"
#include "engine/terrain/completion.h"
#include "engine/terrain/corner_fit.h"
#include "engine/tiling/tile_field.h"

namespace btms {

// Reusable memory of complete_tile(), one a worker.
struct CompleteScratch {
  std::vector<Neighbour> terrain;    // of the tile, square by square
  std::vector<std::uint32_t> begin;  // per square of the held box: its first in `terrain`
  std::vector<std::uint32_t> near;   // those in `terrain` that a group of squares can use
  CompletionScratch completion;
  std::vector<Cell> squares;
};
// Predicts the interior's nodes that are not terrain, from complete_halo() rings. `reach_cells` = l / r. `asked` has a
// flag per square of the held box, or is empty: all are.
void complete_tile(TileField<Node>& nodes, const CompletionRules& rules, double reach_cells, bool by_lattice,
                   std::span<const std::uint8_t> asked, CompleteScratch& scratch);

struct FitRules {
  std::int32_t r_mm;
  std::int64_t steepest_rise2_mm2;  // tan^2(theta) r^2: steeper nodes have no final plane
  double standing_mm;               // points this far above the surface stand on it

  explicit FitRules(const Parameters& p);
};
// Heights of the interior's corners, from kFitHalo rings.
struct CornerHeights {
  std::vector<std::int32_t> corner_mm;  // (rows + 1) x (cols + 1), as in TerrainTile
  std::vector<std::int32_t> centre_mm;  // rows x cols
  std::vector<CornerMean> means;        // while they are worked out
};
void fit_corners(const TileField<Node>& nodes, const FitRules& rules, CornerHeights& heights);
TerrainTile fit_tile(const TileField<Node>& nodes, const FitRules& rules, CornerHeights& scratch);

}  // namespace btms
