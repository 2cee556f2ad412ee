// A single scan: model and label in memory, one call, the way maps are made. Nothing is written, no thread is started,
// and the model has neither steps nor costs. Who only wants labels, scan after scan, takes scan_segmenter.h.
#pragma once

#include <vector>

#include "engine/model/memory_map.h"
#include "engine/terrain/parameters.h"
#include "engine/terrain/segmentation.h"
#include "engine/tiling/build.h"
#include "engine/tiling/label.h"

namespace btms {

struct SegmentedScan {
  MemoryMap map;
  BuildSummary summary;
  LabelCounts counts;
  std::vector<Label> labels;  // one per point, input order
};

// A scan of no points gives an empty map. Throws Error(kBadInput) for one without a single finite point.
// `labels_only`: the map is one tile, and no larger than the labels need (BuildOptions::labels_only); for scans without
// far outliers, which would make that tile huge.
SegmentedScan segment_scan(const PointSource& scan, const Parameters& parameters, bool labels_only = false);

}  // namespace btms
