#include <algorithm>
#include <cmath>

#include "engine/trigonometry.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/tile_steps.h"

namespace btms {
namespace {

// Eq 12-13: the node's final plane and what is stored of it.
NodeSurface finish(const Node& node, std::uint8_t t, const std::array<std::int32_t, 3>& corners,
                   const FitRules& rules) {
  NodeSurface out;
  out.count = static_cast<std::uint16_t>(std::min<std::uint32_t>(node.count, 65535));
  if (std::find(corners.begin(), corners.end(), kUnknownHeight_mm) != corners.end()) return out;
  const FinalPlane plane = FinalPlane::through(t, corners);
  if (plane.rise2_mm2() > rules.steepest_rise2_mm2) return out;

  out.sd_mm = node.sd_mm;
  // Eq 14 measures along the normal; the label itself takes the unrounded value.
  const double slope2 = static_cast<double>(plane.rise2_mm2()) / (static_cast<double>(rules.r_mm) * rules.r_mm);
  out.terrain_mm = saturate_u16(rules.standing_mm * std::sqrt(1 + slope2));
  if (node.node_class != NodeClass::kTerrain) out.support = node.support;
  if (node.is_terrain()) out.weight = static_cast<std::uint8_t>((node.weight * 255u + 32768u) >> 16);
  if (node.node_class == NodeClass::kTerrain) {
    out.state = NodeState::kObserved;
  } else if (node.node_class == NodeClass::kPredicted) {
    out.state = node.occupied ? NodeState::kObstacle : NodeState::kPredicted;
  } else {
    // Not terrain by itself, but terrain all around spans its three corners.
    const double surface =
        static_cast<double>(plane.centre_mm) + (static_cast<double>(plane.rise_x_mm) * node.mean_x_mm +
                                                static_cast<double>(plane.rise_y_mm) * node.mean_y_mm) /
                                                   rules.r_mm;
    const bool stands = node.count > 0 && node.mean_z_mm - surface > rules.standing_mm;
    out.state = stands ? NodeState::kObstacle : NodeState::kPredicted;
  }
  return out;
}

// Forgets corner heights that no node of the tile has a plane through, so that what is stored is what nodes hold.
void drop_unused_corners(TerrainTile& tile) {
  std::vector<std::uint8_t> used(tile.corner_mm.size(), 0);
  const CellBox& box = tile.box;
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) {
      bool centre_used = false;
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        if (tile.nodes[tile.node_index({{col, row}, t})].state == NodeState::kUnknown) continue;
        centre_used = true;
        const auto corners = triangle_corners(t);
        for (int k = 1; k < 3; ++k) used[tile.corner_index({col + corners[k].x / 2, row + corners[k].y / 2})] = 1;
      }
      if (!centre_used) tile.centre_mm[tile.cell_index({col, row})] = kUnknownHeight_mm;
    }
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) tile.corner_mm[i] = kUnknownHeight_mm;
}

}  // namespace

FitRules::FitRules(const Parameters& p) : r_mm(resolution_mm(p)), standing_mm(p.terrain_distance_m * 1000) {
  const double s = sine(radians(p.slope_max_deg)), c = cosine(radians(p.slope_max_deg));
  steepest_rise2_mm2 = static_cast<std::int64_t>(s * s / (c * c) * r_mm * r_mm);
}

// By rows of nodes: each one's plane is worked out once and added to its three corners. Nodes come in ascending order,
// and so do the terms of every corner.
void fit_corners(const TileField<Node>& nodes, const FitRules& rules, CornerHeights& out) {
  const CellBox& box = nodes.interior();
  const auto cols = static_cast<std::size_t>(box.cols()), rows = static_cast<std::size_t>(box.rows());
  out.means.assign((cols + 1) * (rows + 1), CornerMean());
  out.corner_mm.resize((cols + 1) * (rows + 1));
  out.centre_mm.resize(cols * rows);
  const double half = rules.r_mm / 2;
  for (std::int32_t row = box.row0 - 1; row <= box.row1; ++row)
    for (std::int32_t col = box.col0 - 1; col <= box.col1; ++col) {
      const Node* cell = nodes.cell({col, row});
      CornerMean centre;
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        if (!cell[t].is_terrain()) continue;
        const CornerPlane plane(cell[t]);
        centre.add(plane, 0, 0);
        const auto corners = triangle_corners(t);
        for (int k = 1; k < 3; ++k) {
          const std::int32_t x = col + corners[k].x / 2 - box.col0, y = row + corners[k].y / 2 - box.row0;
          if (x < 0 || y < 0 || x > box.cols() || y > box.rows()) continue;
          out.means[static_cast<std::size_t>(y) * (cols + 1) + static_cast<std::size_t>(x)].add(
              plane, (corners[k].x - 1) * half, (corners[k].y - 1) * half);
        }
      }
      if (box.contains({col, row}))
        out.centre_mm[static_cast<std::size_t>(row - box.row0) * cols + static_cast<std::size_t>(col - box.col0)] =
            centre.height_mm();
    }
  for (std::size_t i = 0; i < out.means.size(); ++i) out.corner_mm[i] = out.means[i].height_mm();
}

TerrainTile fit_tile(const TileField<Node>& nodes, const FitRules& rules, CornerHeights& scratch) {
  const CellBox& box = nodes.interior();
  TerrainTile tile(rules.r_mm, box);
  fit_corners(nodes, rules, scratch);
  tile.corner_mm = scratch.corner_mm;
  tile.centre_mm = scratch.centre_mm;
  std::size_t i = 0;
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) {
      const Node* cell = nodes.cell({col, row});
      for (std::uint8_t t = 0; t < kTriangles; ++t)
        tile.nodes[i++] = finish(cell[t], t, tile.corners_mm({{col, row}, t}), rules);
    }
  drop_unused_corners(tile);
  return tile;
}

FinishedTiles fit_pass(const PassContext& context, const NodeFields& nodes) {
  const FitRules rules(context.parameters);
  FinishedTiles tiles(context.pager, nodes.size());
  std::vector<CornerHeights> scratch(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("fit", {reads(nodes), writes(tiles)}, [&](std::size_t i, int worker) {
    tiles[i] = fit_tile(nodes[i], rules, scratch[static_cast<std::size_t>(worker)]);
  });
  return tiles;
}

}  // namespace btms
