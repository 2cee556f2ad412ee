// Labels for one scan after another, for a robot that calls at its sensor's rate: one thread, no files. The fixed
// method keeps its memory from scan to scan; coarse to fine keeps what scans are read into. A scan of 124 k points
// takes some 3 ms with paper-single-scan, 35 ms with single-scan (docs/accuracy.md).
//
//   ScanSegmenter segmenter(preset("single-scan"));
//   for (;;) {
//     const std::vector<float> xyzi = ...;  // the sensor's points, metres
//     for (const Label label : segmenter.segment(interleaved(xyzi.data(), xyzi.size() / 4, 4))) ...
//   }
//
// The labels are those of build_map() and label_points() on the same points, bit for bit.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "engine/terrain/parameters.h"
#include "engine/terrain/segmentation.h"
#include "engine/tiling/label.h"
#include "engine/tiling/point_source.h"

namespace btms {

// Points in the caller's memory: x, y, z as float metres (x east or forward, z up), in any frame that doesn't tilt
// between the points of a scan. Not a number, infinity and what is out of range get Label::kDropped.
struct ScanPoints {
  const float *x_m = nullptr, *y_m = nullptr, *z_m = nullptr;  // of the first point
  std::size_t size = 0;
  std::size_t stride_bytes = sizeof(float);  // from a point to the next; need not be a multiple of 4
};
// Points as a row of floats that starts with x, y, z (KITTI: 4 floats a point).
constexpr ScanPoints interleaved(const float* xyz_m, std::size_t points, std::size_t floats_per_point) {
  return {xyz_m, xyz_m + 1, xyz_m + 2, points, floats_per_point * sizeof(float)};
}

// Not thread-safe: one object a thread. Keeps a few hundred bytes a point of the largest scan so far.
class ScanSegmenter {
 public:
  // Throws Error(kUsage) for parameters that check() refuses.
  explicit ScanSegmenter(const Parameters& parameters);
  ~ScanSegmenter();
  ScanSegmenter(ScanSegmenter&&) noexcept;
  ScanSegmenter& operator=(ScanSegmenter&&) noexcept;

  // One label per point, in order; valid until the next call. No points give no labels. Throws Error(kBadInput) for a
  // scan without a single finite point, Error(kUsage) for one too wide to model, and what `scan` throws.
  std::span<const Label> segment(const ScanPoints& scan);
  std::span<const Label> segment(const PointSource& scan);

  // Of the last scan.
  const LabelCounts& counts() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace btms
