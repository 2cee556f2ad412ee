#include "engine/tiling/segment.h"

#include <algorithm>
#include <array>

namespace btms {

SegmentedScan segment_scan(const PointSource& scan, const Parameters& parameters, bool labels_only) {
  SegmentedScan out;
  const auto threads = serial_threads();
  const auto ranks = single_rank();
  Progress progress;
  BuildOptions options;
  options.parameters = parameters;
  options.layers = false;  // labels don't read them
  options.labels_only = labels_only;
  if (labels_only) options.tile_cells = 0;
  out.map = MemoryMap(MapLayout{Lattice(resolution_mm(parameters)), {}});
  if (scan.size() > 0) {
    const std::array<const PointSource*, 1> sources{&scan};
    out.summary = build_map(
        sources, options, *threads, *ranks,
        [&](const MapLayout& layout) -> TileSink& { return out.map = MemoryMap(layout); }, progress);
  }
  out.labels.resize(static_cast<std::size_t>(scan.size()));
  out.counts = label_points(
      scan, out.map, parameters, *threads,
      [&](std::uint64_t first, std::span<const Label> labels, PointBlock&) {
        std::copy(labels.begin(), labels.end(), out.labels.begin() + static_cast<std::ptrdiff_t>(first));
      },
      progress);
  return out;
}

}  // namespace btms
