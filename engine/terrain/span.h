// Spans: bridge decks that the levels took for terrain. Seen from the side a deck is a narrow flat strip with a sheer
// drop on both sides to ground of about the same level; the ground under it is interpolated between the two feet.
//
// An embankment is no span, its sides slope; nor is a terrace, which drops on one side; nor a ridge, whose top is not
// flat. A causeway between two sheer walls can't be told from a bridge.
//
// Pure integers; thread-safe.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/plane.h"
#include "engine/lattice/tiles.h"
#include "engine/terrain/level_parameters.h"

namespace btms {

struct SpanRules {
  std::int32_t r_mm = 0;
  std::int32_t width_mm = 0;  // of the strip, at most; never more than 64 squares, whatever the parameter says
  std::int32_t drop_mm = 0;   // at least

  SpanRules(const LevelParameters& p, std::int32_t r);
  // The drop happens within this distance, and is steeper than 3 in 4.
  std::int32_t reach_mm() const { return 3 * r_mm; }
  // Rings around a square that decide about it.
  std::int32_t halo() const;
};

// The lowest and the highest ground of a square; kUnknownHeight_mm without any.
struct SquareHeights {
  std::int32_t low_mm = kUnknownHeight_mm;   // mean of the nodes that are about as low as the lowest
  std::int32_t high_mm = kUnknownHeight_mm;  // of the highest node
  bool known() const { return low_mm != kUnknownHeight_mm; }
};

// From the heights of a square's nodes, kUnknownHeight_mm where a node is no accepted terrain.
SquareHeights square_heights(std::span<const std::int32_t> nodes_mm, const SpanRules& rules);

// What lies under a span over a square; unknown where there is no span.
struct SpanGround {
  std::int32_t z_mm = kUnknownHeight_mm;
  std::uint16_t sd_mm = 0;
  bool known() const { return z_mm != kUnknownHeight_mm; }
};

// `heights` row by row over `interior` and halo() rings; the result row by row over the interior.
std::vector<SpanGround> find_spans(const std::vector<SquareHeights>& heights, const CellBox& interior,
                                   const SpanRules& rules);

}  // namespace btms
