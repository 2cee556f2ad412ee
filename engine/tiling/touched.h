// Where the points are not those of the build before.
#pragma once

#include "engine/tiling/ordered_points.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/records.h"

namespace btms {

// Cells of the coarsest level, all of tiles of which nothing is known; keeps what the points are now. Compares sets:
// neither the order of the points nor the files they come in matter. Collective; `context` is of the coarsest level.
Changes touched_cells(const PassContext& context, const OrderedPoints& points, Records& records);

}  // namespace btms
