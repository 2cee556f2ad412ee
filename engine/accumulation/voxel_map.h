// Points of many scans thinned to one per voxel (paper III-B, partial maps): the mean of a voxel's points, with the
// label most of them have.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace btms {

struct LabelledPoint {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
  std::uint32_t label = 0;
};

// Sums of integers: the result depends on the set of points, not on their order. Not thread-safe. Holds 40 bytes for
// each label of a voxel, and as much again (or 3 MB) of points that wait to be merged; twice all that while they are.
class VoxelMap {
 public:
  // Voxels are anchored at multiples of `edge_mm` (1 to 10,000).
  explicit VoxelMap(std::int32_t edge_mm) : edge_mm_(edge_mm) {}

  // Throws Error(kBadInput) for points more than a million voxels from the first.
  void add(std::span<const LabelledPoint> points);

  // Centroids, rounded to millimetres, with the most frequent label (of equally frequent ones the smallest), from
  // bottom to top, then south to north, then west to east. Calls fn(point) for each voxel.
  template <class Fn>
  void for_each_voxel(const Fn& fn) {
    merge();
    for (std::size_t begin = 0; begin < parts_.size();) {
      std::size_t end = begin + 1;
      while (end < parts_.size() && parts_[end].key == parts_[begin].key) ++end;
      fn(whole(std::span(parts_).subspan(begin, end - begin)));
      begin = end;
    }
  }

 private:
  // The points of one label in a voxel.
  struct Part {
    std::uint64_t key = 0;
    std::uint32_t label = 0, count = 0;
    std::array<std::uint64_t, 3> sums_mm{};  // from the voxel's corner
  };
  static bool before(const Part& a, const Part& b) { return a.key != b.key ? a.key < b.key : a.label < b.label; }
  void merge();
  LabelledPoint whole(std::span<const Part> parts) const;

  std::int32_t edge_mm_;
  std::array<std::int64_t, 3> first_{};  // the voxel of the first point
  std::vector<Part> parts_;              // ascending, each once
  std::vector<Part> waiting_;            // merged when there are as many as parts_: the map is not copied for each scan
};

}  // namespace btms
