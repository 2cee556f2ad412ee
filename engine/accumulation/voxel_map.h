// Points of many scans thinned to one per voxel (paper III-B, partial maps): the mean of a voxel's points, with the
// kind most of them have.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace btms {

// What truth says of a point. The ambiguous classes (vegetation, bushes) count as terrain or not by their height in the
// frame of the scan they were seen in, which a map no longer knows: so it is decided before.
enum class PointKind : std::uint8_t { kIgnored, kTerrain, kObject, kAmbiguousLow, kAmbiguousHigh };
inline constexpr std::size_t kPointKinds = 5;

struct AccumulatedPoint {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
  PointKind kind = PointKind::kIgnored;
};

// Sums of integers: the result depends on the set of points, not on their order. Not thread-safe. Holds 56 bytes a
// voxel, twice that while points are added, and 72 bytes for each of these.
class VoxelMap {
 public:
  // Voxels are anchored at multiples of `edge_mm` (1 to 10,000).
  explicit VoxelMap(std::int32_t edge_mm) : edge_mm_(edge_mm) {}

  // Throws Error(kBadInput) for points more than a million voxels from the first.
  void add(std::span<const AccumulatedPoint> points);

  std::size_t size() const { return voxels_.size(); }
  // The centroid, rounded to millimetres, and the kind of voxel i; voxels are ordered from bottom to top, south to
  // north, west to east. Of kinds that are equally frequent it is the first of terrain, object, ambiguous, ignored.
  AccumulatedPoint point(std::size_t i) const;

 private:
  struct Voxel {
    std::uint64_t key = 0;
    std::array<std::uint64_t, 3> sums_mm{};  // from the voxel's corner
    std::array<std::uint32_t, kPointKinds> votes{};
  };
  std::array<std::int64_t, 3> corner_mm(std::uint64_t key) const;

  std::int32_t edge_mm_;
  std::array<std::int64_t, 3> first_{};  // the voxel of the first point
  std::vector<Voxel> voxels_;            // ascending by key
};

}  // namespace btms
