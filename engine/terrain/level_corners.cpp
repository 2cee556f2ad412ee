#include "engine/terrain/level_corners.h"

#include <algorithm>

#include "engine/lattice/lanes.h"
#include "engine/lattice/neighbours.h"

namespace btms {
namespace {

// Corners side by side, a lane each.
struct CornerLanes {
  Lanes z{}, sd{}, weight{};
  struct Plane {
    Lanes w, z;
  };
  std::array<Plane, kIncidentLattice> planes;
  int count = 0;

  // A plane that is seen from (x, y), relative to its mean.
  BTMS_INLINE void add(const Lanes& x, const Lanes& y, const Lanes& mean_z, const Lanes& slope_x, const Lanes& slope_y,
                       const Lanes& mean_weight, const Lanes& mean_sd, double floor_mm) {
    const Lanes distance = sqrt_lanes(x * x + y * y), least = Lanes{} + floor_mm;
    const Lanes w = mean_weight / (least < distance ? distance : least);
    const Lanes height = mean_z + (slope_x * x + slope_y * y) / kSlopeUnit;
    z += w * height;
    sd += w * mean_sd;
    weight += w;
    planes[static_cast<std::size_t>(count++)] = {w, height};
  }
  // Standard error of the weighted mean, from how far the planes are apart.
  BTMS_INLINE Lanes disagreement() const {
    const Lanes mean = z / weight;
    Lanes squares{};
    for (int i = 0; i < count; ++i) {
      const Plane& p = planes[static_cast<std::size_t>(i)];
      squares += p.w * p.w * (p.z - mean) * (p.z - mean);
    }
    return sqrt_lanes(squares) / weight;
  }
  BTMS_INLINE void write(std::span<LevelCorner> out) const {
    const Lanes heights = z / weight, sds = sd / weight, disagreements = disagreement();
    for (std::size_t k = 0; k < std::min(kLanes, out.size()); ++k)
      out[k] = weight[k] > 0 ? LevelCorner{height_mm(heights[k]), saturate_u16(sds[k]), saturate_u16(disagreements[k])}
                             : LevelCorner{};
  }
};

}  // namespace

void PlaneRow::assign(std::span<const LevelNode> squares) {
  const std::size_t n = squares.size() / kTriangles, padded = n + 2 * kLanes;
  for (std::size_t t = 0; t < kTriangles; ++t) {
    Planes& to = planes_[t];
    if (to.x_mm.size() < padded)
      for (std::vector<double>* v : {&to.x_mm, &to.y_mm, &to.z_mm, &to.slope_x, &to.slope_y, &to.weight, &to.sd_mm})
        v->resize(padded);
    for (std::size_t i = 0; i < n; ++i) {
      const LevelNode& node = squares[i * kTriangles + t];
      to.x_mm[i] = node.mean_x_mm;
      to.y_mm[i] = node.mean_y_mm;
      to.z_mm[i] = node.mean_z_mm;
      to.slope_x[i] = node.slope_x;
      to.slope_y[i] = node.slope_y;
      to.weight[i] = node.level_class == LevelClass::kOutside ? 0 : node.weight;
      to.sd_mm[i] = node.sd_mm;
    }
  }
}

CornerRules::CornerRules(const LevelRules& rules)
    : r_mm_(rules.r_mm()),
      half_mm_(rules.r_mm() / 2),
      floor_mm_(std::max(1.0, rules.p().corner_floor_per_r * rules.r_mm())) {}

BTMS_WIDE void CornerRules::corners(const PlaneRow& south, const PlaneRow& north, std::span<LevelCorner> out) const {
  for (std::size_t i = 0; i < out.size(); i += kLanes) {
    CornerLanes corner;
    for (const NodeOffset& o : kIncidentTable) {
      const PlaneRow::Planes& from = (o.row < 0 ? south : north).planes_[o.triangle];
      const std::size_t at = i + static_cast<std::size_t>(o.col + 1);
      corner.add(-(o.col * r_mm_ + half_mm_ + load_lanes(&from.x_mm[at])), -(o.row * r_mm_ + half_mm_ + load_lanes(&from.y_mm[at])),
                 load_lanes(&from.z_mm[at]), load_lanes(&from.slope_x[at]), load_lanes(&from.slope_y[at]), load_lanes(&from.weight[at]),
                 load_lanes(&from.sd_mm[at]), floor_mm_);
    }
    corner.write(out.subspan(i));
  }
}

BTMS_WIDE void CornerRules::centres(const PlaneRow& row, std::span<LevelCorner> out) const {
  for (std::size_t i = 0; i < out.size(); i += kLanes) {
    CornerLanes corner;
    for (const PlaneRow::Planes& from : row.planes_) {
      const std::size_t at = i + 1;
      corner.add(-load_lanes(&from.x_mm[at]), -load_lanes(&from.y_mm[at]), load_lanes(&from.z_mm[at]), load_lanes(&from.slope_x[at]),
                 load_lanes(&from.slope_y[at]), load_lanes(&from.weight[at]), load_lanes(&from.sd_mm[at]), floor_mm_);
    }
    corner.write(out.subspan(i));
  }
}

}  // namespace btms
