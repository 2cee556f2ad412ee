// One cloud, built in every way there is: the digest and the labels must not change by a bit.
#pragma once

#include <string>
#include <vector>

#include "engine/model/memory_map.h"
#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"

namespace btms::test {

struct Way {
  std::int32_t tile_cells;
  std::string executor;  // "serial", "tbb:2", "ranks:3", "ranks:2x2" (two threads in each), "telling:3" (ranks that
                         // tell each other all)
  std::string inputs;    // "as is", "shuffled", "split", "reversed"
  bool lattice = false;  // neighbours by lattice scan
  bool parked = false;   // no memory: whatever is not in use goes to disk
};

// Every tile edge x executor x order of inputs. Ways with ranks come first, since ranks are forked.
std::vector<Way> all_ways(const std::vector<std::int32_t>& tile_cells);

// The map itself, built by serial threads in tiles of `tile_cells`.
MemoryMap build_plain(const std::vector<CloudPoint>& points, const Parameters& parameters, std::int32_t tile_cells);

// Digest of the map, with the digest of all labels (in the order of `points`) appended for in-process executors.
std::string fingerprint(const std::vector<CloudPoint>& points, const Parameters& parameters, const Way& way);

// Expects fingerprint() of every way to equal that of the plain one (one tile, serial, lattice scan).
void expect_one_digest(const std::vector<CloudPoint>& points, const Parameters& parameters,
                       const std::vector<Way>& ways);

}  // namespace btms::test
