// What the levels learn about themselves, pooled over places of the size of the coarsest cells: the scatter of the
// ground's points, and how far each level was from the next finer one.
#pragma once

#include <vector>

#include "engine/terrain/level_node.h"
#include "engine/terrain/scatter.h"
#include "engine/tiling/level_surface.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/records.h"

namespace btms {

// One value a cell of the coarsest level, in triangle 0 (a bin is such a cell); one ring of halo.
using ScatterFields = TileFields<GroundScatter>;
inline constexpr std::int32_t kScatterHalo = 1;

// The cell of the coarsest level, `refinements` levels up.
constexpr Cell coarsest_cell(Cell c, int refinements) {
  return {static_cast<std::int32_t>(floor_div(c.col, 1 << refinements)),
          static_cast<std::int32_t>(floor_div(c.row, 1 << refinements))};
}

struct Measured {
  ScatterFields fields;  // without halos
  Changes changes;       // cells of the coarsest level that measure otherwise than the record
};
// Where what is measured is kept, and the tiles where it has to be measured anew: the others have what is recorded.
struct Measuring {
  const Records& records;
  int number;
  const TileSet& anew;
};

// Points below the surface. Collective.
Measured measure_ground(const PassContext& context, const TileTable& coarsest, int refinements,
                        const OrderedPoints& points, const Surfaces& surfaces, const Measuring& measuring);

// Fitted nodes against the prior they had. Collective.
Measured measure_misfit(const PassContext& context, const TileTable& coarsest, int refinements,
                        const TileFields<LevelNode>& nodes, const Measuring& measuring);

// The values of the interior, row by row.
std::vector<GroundScatter> cells_of(const TileField<GroundScatter>& scatter);

// The sum over a cell and its ring.
GroundScatter around(const TileField<GroundScatter>& scatter, Cell coarsest);

}  // namespace btms
