#include "io/client/tile_snapshot.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "io/store/served_tiles.h"

namespace btms {
namespace {

struct Square {
  TileId tile;
  std::size_t index;  // of a layer's values
};

Square square_of(double cell_m, Place place) {
  constexpr double kMost = 1e9;  // beyond maps; NaN becomes it, too
  const auto at = [&](double m) {
    const double square = std::floor(m / cell_m);
    return static_cast<std::int64_t>(std::abs(square) <= kMost ? square : kMost);
  };
  const std::int64_t col = at(place.x_m), row = at(place.y_m);
  const TileId id{static_cast<std::int32_t>(floor_div(col, kServedCells)),
                  static_cast<std::int32_t>(floor_div(row, kServedCells))};
  const std::int64_t from_west = col - std::int64_t{id.tx} * kServedCells,
                     from_north = kServedCells - 1 - (row - std::int64_t{id.ty} * kServedCells);
  return {id, static_cast<std::size_t>(from_north * kServedCells + from_west)};
}

// Of the squares whose values differ in a bit.
BoxM changed_squares(const ClientTile& a, const ClientTile& b, double cell_m) {
  if (a.values.size() != b.values.size()) return b.bounds_m;
  std::size_t west = kServedCells, east = 0, north = kServedCells, south = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    if (std::memcmp(&a.values[i], &b.values[i], sizeof(float)) == 0) continue;
    const std::size_t col = i % kServedCells, row = i / kServedCells % kServedCells;
    west = std::min(west, col);
    east = std::max(east, col + 1);
    north = std::min(north, row);
    south = std::max(south, row + 1);
  }
  if (east == 0) return b.bounds_m;  // another validator and the same values: take its word for it
  const auto m = [&](std::size_t squares) { return static_cast<double>(squares) * cell_m; };
  return {b.bounds_m[0] + m(west), b.bounds_m[3] - m(south), b.bounds_m[0] + m(east), b.bounds_m[3] - m(north)};
}

// Whether the snapshot would have the tile, were there one.
bool looked_at(const TileSnapshot& snapshot, const BoxM& box) {
  const double dx = snapshot.centre.x_m - std::clamp(snapshot.centre.x_m, box[0], box[2]);
  const double dy = snapshot.centre.y_m - std::clamp(snapshot.centre.y_m, box[1], box[3]);
  return snapshot.all && dx * dx + dy * dy <= snapshot.radius_m * snapshot.radius_m;
}

}  // namespace

const ClientTile* TileSnapshot::tile(Place place) const {
  if (tiles.empty()) return nullptr;
  const auto it = tiles.find(square_of(form.cell_m, place).tile);
  return it == tiles.end() ? nullptr : it->second.get();
}

float TileSnapshot::value(std::size_t layer, Place place) const {
  const ClientTile* found = tile(place);
  const std::size_t index =
      found ? layer * kServedCells * kServedCells + square_of(form.cell_m, place).index : std::size_t{0};
  return found && index < found->values.size() ? found->values[index] : std::numeric_limits<float>::quiet_NaN();
}

std::size_t TileSnapshot::bytes() const {
  std::size_t sum = 0;
  for (const auto& entry : tiles) sum += entry.second->values.size() * sizeof(float);
  return sum;
}

std::vector<BoxM> differences(const TileSnapshot& before, const TileSnapshot& after) {
  std::vector<BoxM> out;
  if (before.number == 0) return out;
  for (const auto& [id, tile] : after.tiles) {
    const auto old = before.tiles.find(id);
    if (old == before.tiles.end()) {
      if (looked_at(before, tile->bounds_m)) out.push_back(tile->bounds_m);
    } else if (old->second->etag != tile->etag) {
      out.push_back(changed_squares(*old->second, *tile, after.form.cell_m));
    }
  }
  for (const auto& [id, tile] : before.tiles)
    if (!after.tiles.contains(id) && looked_at(after, tile->bounds_m)) out.push_back(tile->bounds_m);
  return out;
}

}  // namespace btms
