#include "engine/accumulation/ground_alignment.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace btms {
namespace {

constexpr double kPatch_m = 1, kSquare_m = 2;
constexpr double kNoise_m = 0.03;       // of a scan's ground in a square
constexpr double kSquareSlope = 0.3;    // squares are this steep at most times
constexpr double kStepHeight_m = 0.05;  // what odometry may lose from a scan to the next
constexpr double kStepTilt = 0.01;      // radians
constexpr double kFirstPose = 1e-5;     // how firmly the first one is held: metres, radians
constexpr std::size_t kScansForSmear = 3;
// Residuals from here on count less and less; from wide to narrow, so that a loop that is off by metres still closes.
constexpr double kScales_m[] = {0.5, 0.15, 0.06, 0.06, 0.06};
constexpr int kLinearisations = 2;

using Correction = Eigen::Vector3d;  // of a scan: height, and slopes along x and y about the sensor's place

struct Square {
  std::int64_t col, row;
  friend auto operator<=>(const Square&, const Square&) = default;
};

// The ground that one scan saw in one square, map frame.
struct Sighting {
  Eigen::Index scan, square;
  double x_m, y_m;    // from the square's centre
  double dx_m, dy_m;  // from the sensor
  double z_m;
  double weight = 1;
};

// Sightings scan by scan; squares that one scan alone saw are left out.
struct Sightings {
  std::vector<Sighting> all;
  Eigen::Index squares = 0;
};

Sightings find_sightings(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses) {
  struct Sum {
    double x = 0, y = 0, z = 0, n = 0;
  };
  std::vector<std::map<Square, Sum>> sums(ground.size());
  std::map<Square, std::pair<std::size_t, Eigen::Index>> seen;  // by how many scans; the square's number
  for (std::size_t i = 0; i < ground.size(); ++i) {
    for (const GroundPatch& patch : ground[i]) {
      const auto [x, y, z] = poses[i].to_map({patch.x_m, patch.y_m, patch.z_m});
      Sum& sum = sums[i][{static_cast<std::int64_t>(std::floor(x / kSquare_m)),
                          static_cast<std::int64_t>(std::floor(y / kSquare_m))}];
      sum = {sum.x + x, sum.y + y, sum.z + z, sum.n + 1};
    }
    for (const auto& entry : sums[i]) ++seen[entry.first].first;
  }
  Sightings out;
  for (auto& [square, count] : seen) count.second = count.first > 1 ? out.squares++ : -1;
  for (std::size_t i = 0; i < ground.size(); ++i)
    for (const auto& [square, sum] : sums[i]) {
      const Eigen::Index number = seen.at(square).second;
      if (number < 0) continue;
      const double x = sum.x / sum.n, y = sum.y / sum.n;
      out.all.push_back({static_cast<Eigen::Index>(i), number, x - (static_cast<double>(square.col) + 0.5) * kSquare_m,
                         y - (static_cast<double>(square.row) + 0.5) * kSquare_m, x - poses[i].place_m[0],
                         y - poses[i].place_m[1], sum.z / sum.n});
    }
  return out;
}

// Unknowns: three numbers a scan, then the plane of each square (height and slopes).
struct Unknowns {
  Eigen::Index scans, squares;
  Eigen::Index size() const { return 3 * (scans + squares); }
  Eigen::Index scan(const Sighting& s) const { return 3 * s.scan; }
  Eigen::Index plane(const Sighting& s) const { return 3 * (scans + s.square); }
};

// How far a sighting lies off its square's plane.
double residual(const Sighting& s, const Unknowns& unknowns, const Eigen::VectorXd& solution) {
  const auto correction = solution.segment<3>(unknowns.scan(s)), plane = solution.segment<3>(unknowns.plane(s));
  return s.z_m + correction.dot(Correction(1, s.dx_m, s.dy_m)) - plane.dot(Eigen::Vector3d(1, s.x_m, s.y_m));
}

// The normal equations of one reweighted step.
class Problem {
 public:
  Problem(const Sightings& sightings, const Unknowns& unknowns, std::span<const Correction> so_far)
      : size_(unknowns.size()), right_(Eigen::VectorXd::Zero(size_)) {
    for (const Sighting& s : sightings.all) {
      const Eigen::Index scan = unknowns.scan(s), plane = unknowns.plane(s);
      const Eigen::Index at[] = {scan, scan + 1, scan + 2, plane, plane + 1, plane + 2};
      const double factors[] = {1, s.dx_m, s.dy_m, -1, -s.x_m, -s.y_m};
      add(at, factors, -s.z_m, s.weight / (kNoise_m * kNoise_m));
    }
    for (Eigen::Index k = 3 * unknowns.scans; k < size_; k += 3)
      for (const Eigen::Index slope : {k + 1, k + 2}) pull_to_zero(slope, kSquareSlope);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      pull_to_zero(axis, kFirstPose);
      const double step = axis == 0 ? kStepHeight_m : kStepTilt;
      for (Eigen::Index i = 1; i < unknowns.scans; ++i) {
        const Eigen::Index at[] = {3 * i + axis, 3 * (i - 1) + axis};
        const double factors[] = {1, -1};
        const auto k = static_cast<std::size_t>(i);
        add(at, factors, so_far[k - 1][axis] - so_far[k][axis], 1 / (step * step));
      }
    }
  }

  Eigen::VectorXd solve() const {
    Eigen::SparseMatrix<double> matrix(size_, size_);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right_);
  }

 private:
  // factors . unknowns = value
  void add(std::span<const Eigen::Index> at, std::span<const double> factors, double value, double weight) {
    for (std::size_t i = 0; i < at.size(); ++i) {
      right_[at[i]] += weight * factors[i] * value;
      for (std::size_t k = 0; k < at.size(); ++k)
        if (at[k] <= at[i])
          entries_.emplace_back(static_cast<int>(at[i]), static_cast<int>(at[k]), weight * factors[i] * factors[k]);
    }
  }
  void pull_to_zero(Eigen::Index at, double sigma) {
    const double one = 1;
    add({&at, 1}, {&one, 1}, 0, 1 / (sigma * sigma));
  }

  Eigen::Index size_;
  std::vector<Eigen::Triplet<double>> entries_;  // lower triangle
  Eigen::VectorXd right_;
};

// Raises the sensor by c[0] and tilts what it saw so that ground rises by c[1] along x and c[2] along y.
Pose corrected(const Pose& pose, const Correction& c) {
  const Eigen::Vector3d axis(c[2], -c[1], 0);
  const double slope = axis.norm();
  Pose out = pose;
  if (slope > 0) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(std::atan(slope), axis / slope).toRotationMatrix();
    using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Map<Rotation>(out.rotation.data()) = turn * Eigen::Map<const Rotation>(pose.rotation.data());
  }
  out.place_m[2] += c[0];
  return out;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double smear_m(const Sightings& sightings) {
  std::vector<std::vector<const Sighting*>> by_square(static_cast<std::size_t>(sightings.squares));
  for (const Sighting& s : sightings.all) by_square[static_cast<std::size_t>(s.square)].push_back(&s);
  std::vector<double> ranges;
  for (const auto& seen : by_square) {
    if (seen.size() < kScansForSmear) continue;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const double pull = kNoise_m * kNoise_m / (kSquareSlope * kSquareSlope);
    matrix(1, 1) = matrix(2, 2) = pull;
    for (const Sighting* s : seen) {
      const Eigen::Vector3d at(1, s->x_m, s->y_m);
      matrix += at * at.transpose();
      right += at * s->z_m;
    }
    const Eigen::Vector3d plane = matrix.ldlt().solve(right);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Sighting* s : seen) {
      const double off = s->z_m - plane.dot(Eigen::Vector3d(1, s->x_m, s->y_m));
      low = std::min(low, off);
      high = std::max(high, off);
    }
    ranges.push_back(high - low);
  }
  return median(std::move(ranges));
}

}  // namespace

std::vector<GroundPatch> ground_patches(const PointBlock& points, std::span<const Label> labels) {
  struct Sum {
    std::int64_t x = 0, y = 0, z = 0, n = 0;
  };
  constexpr auto kPatch_mm = static_cast<std::int64_t>(kPatch_m * 1000);
  constexpr double kRange_mm = kGroundRange_m * 1000;
  std::map<Square, Sum> sums;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != Label::kTerrain) continue;
    const std::int64_t x = points.x_mm[i], y = points.y_mm[i];
    if (std::hypot(static_cast<double>(x), static_cast<double>(y)) > kRange_mm) continue;
    Sum& sum = sums[{floor_div(x, kPatch_mm), floor_div(y, kPatch_mm)}];
    sum = {sum.x + x, sum.y + y, sum.z + points.z_mm[i], sum.n + 1};
  }
  std::vector<GroundPatch> patches;
  for (const auto& entry : sums) {
    const Sum& s = entry.second;
    const auto mean_m = [&](std::int64_t sum) {
      return static_cast<float>(static_cast<double>(sum) / (1000.0 * static_cast<double>(s.n)));
    };
    patches.push_back({mean_m(s.x), mean_m(s.y), mean_m(s.z)});
  }
  return patches;
}

AlignedPoses align_ground(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses) {
  AlignedPoses out;
  out.poses.assign(poses.begin(), poses.end());
  std::vector<Correction> total(poses.size(), Correction::Zero());
  for (int linearisation = 0; linearisation < kLinearisations; ++linearisation) {
    Sightings sightings = find_sightings(ground, out.poses);
    if (linearisation == 0) out.smear_before_m = smear_m(sightings);
    if (sightings.all.empty()) return out;
    const Unknowns unknowns{static_cast<Eigen::Index>(poses.size()), sightings.squares};
    Eigen::VectorXd solution = Problem(sightings, unknowns, total).solve();
    for (const double scale_m : kScales_m) {
      for (Sighting& s : sightings.all) {
        const double off = residual(s, unknowns, solution) / scale_m;
        s.weight = 1 / (1 + off * off);
      }
      solution = Problem(sightings, unknowns, total).solve();
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Correction c = solution.segment<3>(static_cast<Eigen::Index>(3 * i));
      total[i] += c;
      out.poses[i] = corrected(out.poses[i], c);
    }
  }
  out.smear_after_m = smear_m(find_sightings(ground, out.poses));
  for (const Correction& c : total) {
    out.largest_m = std::max(out.largest_m, std::abs(c[0]));
    out.largest_tilt_deg = std::max(out.largest_tilt_deg, std::atan(std::hypot(c[1], c[2])) * 180 / std::numbers::pi);
  }
  return out;
}

}  // namespace btms
