// A finished map against the exact terrain of a synthetic scene, for `btms eval --map`.
#pragma once

#include <vector>

#include "engine/metrics/surface_scores.h"
#include "engine/model/tile_store.h"
#include "engine/scenes/scene.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/progress.h"

namespace btms {

// Samples map and truth at places on a square grid every `spacing_m` over the scene, off the lattice by odd shares so
// that none lies on an edge of the lattice again and again. The group of a sample is its Stratum. The same samples in
// the same order for any number of threads. Throws what map.load() throws, Error(kUsage) for more than 2^28 places (4
// GB).
std::vector<SurfaceSample> sample_map(const TileSource& map, const Scene& scene, double spacing_m,
                                      const Threads& threads, Progress& progress);

struct MapEvalHeading {
  std::string map;
  SceneOptions scene;
  double spacing_m = 0;
};
// Warns when the samples look as if the map were of another scene, or of more or less of it.
void warn_of_another_scene(std::span<const SurfaceSample> samples);
void print_map_eval_text(const MapEvalHeading& heading, std::span<const SurfaceSample> samples);
void print_map_eval_json(const MapEvalHeading& heading, std::span<const SurfaceSample> samples);

}  // namespace btms
