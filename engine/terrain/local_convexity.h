// Local convexity and concavity lcc(e_ij) between two terrain candidates (paper Eq 6).
//
// eps1 bounds the difference of the normals and eps2 the distance from the planes, as the paper's text says; its
// formula has them the other way round, which lets only one edge in seven pass (docs/paper_map.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/terrain/node.h"
#include "engine/terrain/parameters.h"
#include "engine/trigonometry.h"

namespace btms {

struct ConvexityRules {
  double normal_similarity_per_mm;  // eps1
  double sine_plane_distance;       // sin(eps2)

  explicit ConvexityRules(const Parameters& p)
      : normal_similarity_per_mm(p.normal_similarity / 1000),
        sine_plane_distance(sine(std::min(p.plane_distance, kPi / 2))) {}
};

// Of unit normals s and d = m_j - m_i, millimetres. Symmetric to the bit: swapping i and j (and the sign of d) only
// changes signs.
inline bool locally_convex(const Eigen::Vector3d& s_i, const Eigen::Vector3d& s_j, const Eigen::Vector3d& d_mm,
                           const ConvexityRules& rules) {
  const double distance = std::sqrt(d_mm.x() * d_mm.x() + d_mm.y() * d_mm.y() + d_mm.z() * d_mm.z());
  const double cos_between = s_i.x() * s_j.x() + s_i.y() * s_j.y() + s_i.z() * s_j.z();
  // sin(min(|d| eps1, pi/2)): the sine is not monotone beyond
  if (!(cos_between >= 1 - sine(std::min(distance * rules.normal_similarity_per_mm, kPi / 2)))) return false;
  const double reach = distance * rules.sine_plane_distance;
  return std::abs(s_j.x() * d_mm.x() + s_j.y() * d_mm.y() + s_j.z() * d_mm.z()) <= reach &&
         std::abs(s_i.x() * d_mm.x() + s_i.y() * d_mm.y() + s_i.z() * d_mm.z()) <= reach;
}

inline bool locally_convex(const Node& i, const Node& j, const Eigen::Vector3d& d_mm, const ConvexityRules& rules) {
  return locally_convex(normal_of(i), normal_of(j), d_mm, rules);
}

}  // namespace btms
