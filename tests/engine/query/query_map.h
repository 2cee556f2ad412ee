// A map made by hand for tests of queries: tiles of 16 x 16 squares of 2 m on rolling ground, some squares unknown.
#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "engine/error.h"
#include "engine/model/memory_map.h"
#include "tests/support/cloud.h"

namespace btms::test {

inline MemoryMap rolling_map(std::int32_t tiles_across) {
  MapLayout layout{Lattice(2000), {16, {}}};
  MemoryMap map(layout);
  Random random(7);
  const auto height_mm = [](double x, double y) {
    return static_cast<std::int32_t>(1000 * (std::sin(x / 9) + std::cos(y / 7)));
  };
  for (std::int32_t ty = 0; ty < tiles_across; ++ty)
    for (std::int32_t tx = 0; tx < tiles_across; ++tx) {
      TerrainTile tile(2000, layout.grid.box_of({tx, ty}));
      const CellBox& box = tile.box;
      for (std::int32_t row = box.row0; row <= box.row1; ++row)
        for (std::int32_t col = box.col0; col <= box.col1; ++col) {
          tile.corner_mm[tile.corner_index({col, row})] = height_mm(2.0 * col, 2.0 * row);
          if (!box.contains({col, row})) continue;
          const std::size_t cell = tile.cell_index({col, row});
          const bool unknown = random.between(0, 19) == 0;
          if (!unknown) tile.centre_mm[cell] = height_mm(2.0 * col + 1, 2.0 * row + 1);
          for (std::size_t t = 0; t < kTriangles; ++t) {
            NodeSurface& node = tile.nodes[cell * kTriangles + t];
            if (unknown) continue;
            node.state = random.between(0, 2) == 0 ? NodeState::kPredicted : NodeState::kObserved;
            node.sd_mm = static_cast<std::uint16_t>(random.between(1, 400));
            node.cost = static_cast<std::uint8_t>(random.between(0, 255));
            node.roughness_mm = static_cast<std::uint16_t>(random.between(0, 60));
            node.step_mm = static_cast<std::uint16_t>(random.between(0, 300));
          }
          if (!unknown && random.between(0, 9) == 0)
            tile.upper.push_back({static_cast<std::uint32_t>(cell * kTriangles + 1), 8000, 100, -200, 20, 9,
                                  random.between(0, 1) == 0 ? UpperKind::kReachable : UpperKind::kDetached});
        }
      map.put({tx, ty}, std::move(tile));
    }
  return map;
}

// Counts loads, copies what it gives, and can refuse one tile.
class CountingMap final : public TileSource {
 public:
  explicit CountingMap(const MemoryMap& map) : map_(map) {}
  const MapLayout& layout() const override { return map_.layout(); }
  std::vector<TileId> tiles() const override { return map_.tiles(); }
  std::shared_ptr<const TerrainTile> load(TileId id) const override {
    ++loads;
    if (slow) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (refuse && id == TileId{1, 1}) throw Error(ErrorCode::kVerification, "damaged");
    return std::make_shared<const TerrainTile>(*map_.load(id));
  }
  mutable std::atomic<int> loads{0};
  std::atomic<bool> refuse{false}, slow{false};

 private:
  const MemoryMap& map_;
};

}  // namespace btms::test
