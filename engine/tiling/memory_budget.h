// How much a build holds, and how much of it may stay in memory.
#pragma once

#include <cstdint>

#include "engine/terrain/parameters.h"

namespace btms {

// Points and nodes at the worst moment, in memory or parked. Measured: docs/performance.md.
double working_set_bytes(const Parameters& parameters, double points, double nodes);

// What points and nodes may take of a limit on the process: all but the program itself and what threads work on.
// kUnlimited_bytes stays what it is.
std::uint64_t paged_bytes(std::uint64_t memory_bytes, int threads);

}  // namespace btms
