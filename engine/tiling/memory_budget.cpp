#include "engine/tiling/memory_budget.h"

#include "engine/tiling/pager.h"

namespace btms {

double working_set_bytes(const Parameters& parameters, double points, double nodes) {
  const double node_bytes = parameters.method == Method::kCoarseToFine ? 88 : 26;
  return 8.8 * points + node_bytes * nodes;
}

std::uint64_t paged_bytes(std::uint64_t memory_bytes, int threads) {
  if (memory_bytes == kUnlimited_bytes) return kUnlimited_bytes;
  // The eighth is for lists that grow with the map and aren't counted, and for what the allocator has not given back.
  const std::uint64_t aside =
      (std::uint64_t{32} << 20) + (std::uint64_t{24} << 20) * static_cast<unsigned>(threads) + memory_bytes / 8;
  return memory_bytes > 2 * aside ? memory_bytes - aside : memory_bytes / 2;
}

}  // namespace btms
