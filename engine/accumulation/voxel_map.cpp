#include "engine/accumulation/voxel_map.h"

#include <algorithm>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

constexpr int kAxisBits = 21;
constexpr std::size_t kLeastMerge = 1 << 16;
constexpr std::int64_t kReach = std::int64_t{1} << (kAxisBits - 1);

}  // namespace

void VoxelMap::add(std::span<const LabelledPoint> points) {
  if (points.empty()) return;
  const auto voxel_of = [&](const LabelledPoint& p) -> std::array<std::int64_t, 3> {
    return {floor_div(p.x_mm, edge_mm_), floor_div(p.y_mm, edge_mm_), floor_div(p.z_mm, edge_mm_)};
  };
  if (parts_.empty() && waiting_.empty()) first_ = voxel_of(points[0]);
  for (const LabelledPoint& p : points) {
    const std::array<std::int64_t, 3> voxel = voxel_of(p), place{p.x_mm, p.y_mm, p.z_mm};
    Part part{0, p.label, 1, {}};
    for (std::size_t axis = 3; axis-- > 0;) {
      const std::int64_t step = voxel[axis] - first_[axis] + kReach;
      if (step < 0 || step >= 2 * kReach)
        throw Error(ErrorCode::kBadInput, "found points more than " + std::to_string(kReach * edge_mm_ / 1'000'000) +
                                              " km apart: poses or points are wrong, or voxels too small");
      part.key = part.key << kAxisBits | static_cast<std::uint64_t>(step);
      part.sums_mm[axis] = static_cast<std::uint64_t>(place[axis] - voxel[axis] * edge_mm_);
    }
    waiting_.push_back(part);
  }
  if (waiting_.size() >= std::max(kLeastMerge, parts_.size())) merge();
}

void VoxelMap::merge() {
  if (waiting_.empty()) return;
  std::sort(waiting_.begin(), waiting_.end(), before);
  std::vector<Part> merged;
  merged.reserve(parts_.size() + waiting_.size());
  std::merge(parts_.begin(), parts_.end(), waiting_.begin(), waiting_.end(), std::back_inserter(merged), before);
  waiting_.clear();
  std::size_t kept = 0;
  for (const Part& part : merged) {
    Part* last = kept > 0 ? &merged[kept - 1] : nullptr;
    if (!last || before(*last, part)) {
      merged[kept++] = part;
      continue;
    }
    last->count += part.count;
    for (std::size_t axis = 0; axis < 3; ++axis) last->sums_mm[axis] += part.sums_mm[axis];
  }
  merged.resize(kept);
  parts_ = std::move(merged);
}

LabelledPoint VoxelMap::whole(std::span<const Part> parts) const {
  const Part* most = &parts[0];
  std::array<std::uint64_t, 3> sums{};
  std::uint64_t n = 0;
  for (const Part& part : parts) {
    if (part.count > most->count) most = &part;
    for (std::size_t axis = 0; axis < 3; ++axis) sums[axis] += part.sums_mm[axis];
    n += part.count;
  }
  const auto mean = [&](std::size_t axis) {
    const auto step = static_cast<std::int64_t>(parts[0].key >> (kAxisBits * axis) & (2 * kReach - 1));
    return (step - kReach + first_[axis]) * edge_mm_ + static_cast<std::int64_t>((sums[axis] + n / 2) / n);
  };
  return {mean(0), mean(1), static_cast<std::int32_t>(mean(2)), most->label};
}

}  // namespace btms
