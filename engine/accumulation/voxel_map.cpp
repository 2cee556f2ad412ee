#include "engine/accumulation/voxel_map.h"

#include <algorithm>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

constexpr int kAxisBits = 21;
constexpr std::int64_t kReach = std::int64_t{1} << (kAxisBits - 1);

struct Sample {
  std::uint64_t key;
  std::array<std::uint16_t, 3> from_corner_mm;
  PointKind kind;
};

}  // namespace

void VoxelMap::add(std::span<const AccumulatedPoint> points) {
  if (points.empty()) return;
  const auto voxel_of = [&](const AccumulatedPoint& p) -> std::array<std::int64_t, 3> {
    return {floor_div(p.x_mm, edge_mm_), floor_div(p.y_mm, edge_mm_), floor_div(p.z_mm, edge_mm_)};
  };
  if (voxels_.empty()) first_ = voxel_of(points[0]);
  std::vector<Sample> samples;
  samples.reserve(points.size());
  for (const AccumulatedPoint& p : points) {
    const std::array<std::int64_t, 3> voxel = voxel_of(p), place{p.x_mm, p.y_mm, p.z_mm};
    Sample sample{0, {}, p.kind};
    for (std::size_t axis = 3; axis-- > 0;) {
      const std::int64_t step = voxel[axis] - first_[axis] + kReach;
      if (step < 0 || step >= 2 * kReach)
        throw Error(ErrorCode::kBadInput, "found points more than " + std::to_string(kReach * edge_mm_ / 1'000'000) +
                                              " km apart: poses or points are wrong, or voxels too small");
      sample.key = sample.key << kAxisBits | static_cast<std::uint64_t>(step);
      sample.from_corner_mm[axis] = static_cast<std::uint16_t>(place[axis] - voxel[axis] * edge_mm_);
    }
    samples.push_back(sample);
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.key < b.key; });

  std::vector<Voxel> merged;
  merged.reserve(voxels_.size() + samples.size());
  auto old = voxels_.cbegin();
  for (auto s = samples.cbegin(); s != samples.cend();) {
    for (; old != voxels_.cend() && old->key < s->key; ++old) merged.push_back(*old);
    Voxel voxel{s->key, {}, {}};
    if (old != voxels_.cend() && old->key == s->key) voxel = *old++;
    for (; s != samples.cend() && s->key == voxel.key; ++s) {
      for (std::size_t axis = 0; axis < 3; ++axis) voxel.sums_mm[axis] += s->from_corner_mm[axis];
      ++voxel.votes[static_cast<std::size_t>(s->kind)];
    }
    merged.push_back(voxel);
  }
  merged.insert(merged.end(), old, voxels_.cend());
  voxels_ = std::move(merged);
}

std::array<std::int64_t, 3> VoxelMap::corner_mm(std::uint64_t key) const {
  std::array<std::int64_t, 3> corner;
  for (std::size_t axis = 0; axis < 3; ++axis, key >>= kAxisBits)
    corner[axis] = (static_cast<std::int64_t>(key & (2 * kReach - 1)) - kReach + first_[axis]) * edge_mm_;
  return corner;
}

AccumulatedPoint VoxelMap::point(std::size_t i) const {
  const Voxel& voxel = voxels_[i];
  const auto votes = [&](PointKind kind) { return std::uint64_t{voxel.votes[static_cast<std::size_t>(kind)]}; };
  const std::uint64_t low = votes(PointKind::kAmbiguousLow), high = votes(PointKind::kAmbiguousHigh);
  const std::pair<std::uint64_t, PointKind> kinds[] = {
      {votes(PointKind::kTerrain), PointKind::kTerrain},
      {votes(PointKind::kObject), PointKind::kObject},
      {low + high, low >= high ? PointKind::kAmbiguousLow : PointKind::kAmbiguousHigh},
      {votes(PointKind::kIgnored), PointKind::kIgnored}};
  std::uint64_t n = 0;
  const auto* most = kinds;
  for (const auto& kind : kinds) {
    n += kind.first;
    if (kind.first > most->first) most = &kind;
  }
  const auto corner = corner_mm(voxel.key);
  const auto mean = [&](std::size_t axis) {
    return corner[axis] + static_cast<std::int64_t>((voxel.sums_mm[axis] + n / 2) / n);
  };
  return {mean(0), mean(1), static_cast<std::int32_t>(mean(2)), most->second};
}

}  // namespace btms
