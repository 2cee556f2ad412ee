#include "engine/accumulation/ground_alignment.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "engine/error.h"

namespace btms {
namespace {

constexpr double kPatch_m = 0.5, kSquare_m = 0.5;
constexpr double kRoughest_m = 0.05;    // standard deviation of heights in a patch: above it, it is no bare ground
constexpr double kNoise_m = 0.03;       // of a scan's ground in a square
constexpr double kSquareSlope = 0.3;    // squares are this steep at most times
constexpr double kStepHeight_m = 0.05;  // what odometry may lose from a scan to the next
constexpr double kStepTilt = 0.002;     // radians
constexpr double kFirstPose = 1e-5;     // how firmly the first one is held: metres, radians
constexpr std::size_t kScansForSmear = 3;
// Pairs of scans that share a square are what a solve costs: of a place where a vehicle waited for minutes each square
// takes some of the scans, another square others.
constexpr std::size_t kMostOfSquare = 64;
// Residuals from here on count less and less; from wide to narrow, so that a loop that is off by metres still closes.
constexpr double kScales_m[] = {0.5, 0.15, 0.06, 0.03, 0.03, 0.03};
constexpr int kLinearisations = 2;

using Correction = Eigen::Vector3d;  // of a scan: height, and slopes along x and y about the sensor's place

struct Square {
  std::int64_t col, row;
  friend auto operator<=>(const Square&, const Square&) = default;
};

// The ground that one scan saw in one square, map frame.
struct Sighting {
  std::size_t scan, square;
  double x_m, y_m;    // from the square's centre
  double dx_m, dy_m;  // from the sensor
  double z_m;
  double weight = 1;
};

// Sightings scan by scan; squares that one scan alone saw are left out.
struct Sightings {
  std::vector<Sighting> all;
  std::vector<std::vector<std::size_t>> by_square;  // which of them lie in it
};

Sightings find_sightings(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses) {
  struct Sum {
    double x = 0, y = 0, z = 0, n = 0;
  };
  std::vector<std::map<Square, Sum>> sums(ground.size());
  struct Seen {
    std::size_t scans = 0, number = 0, met = 0;
    bool takes_next() { return (met++ + number) * kMostOfSquare % scans < std::min(kMostOfSquare, scans); }
  };
  std::map<Square, Seen> seen;
  for (std::size_t i = 0; i < ground.size(); ++i) {
    for (const GroundPatch& patch : ground[i]) {
      const auto [x, y, z] = poses[i].to_map({patch.x_m, patch.y_m, patch.z_m});
      Sum& sum = sums[i][{static_cast<std::int64_t>(std::floor(x / kSquare_m)),
                          static_cast<std::int64_t>(std::floor(y / kSquare_m))}];
      sum = {sum.x + x, sum.y + y, sum.z + z, sum.n + 1};
    }
    for (const auto& entry : sums[i]) ++seen[entry.first].scans;
  }
  Sightings out;
  std::size_t squares = 0;
  for (auto& entry : seen)
    if (entry.second.scans > 1) entry.second.number = squares++;
  out.by_square.resize(squares);
  for (std::size_t i = 0; i < ground.size(); ++i)
    for (const auto& [square, sum] : sums[i]) {
      Seen& by = seen.at(square);
      if (by.scans < 2 || !by.takes_next()) continue;
      const double x = sum.x / sum.n, y = sum.y / sum.n;
      out.by_square[by.number].push_back(out.all.size());
      out.all.push_back({i, by.number, x - (static_cast<double>(square.col) + 0.5) * kSquare_m,
                         y - (static_cast<double>(square.row) + 0.5) * kSquare_m, x - poses[i].place_m[0],
                         y - poses[i].place_m[1], sum.z / sum.n});
    }
  return out;
}

Correction lever(const Sighting& s) { return {1, s.dx_m, s.dy_m}; }
Eigen::Vector3d place(const Sighting& s) { return {1, s.x_m, s.y_m}; }

// Planes of squares, given the corrections: those are eliminated (Schur) from the equations of the scans.
struct Planes {
  std::vector<Eigen::Matrix3d> inverse;  // of a square's own normal matrix

  explicit Planes(const Sightings& sightings) {
    const double pull = kNoise_m * kNoise_m / (kSquareSlope * kSquareSlope);
    inverse.assign(sightings.by_square.size(), Eigen::Vector3d(0, pull, pull).asDiagonal());
    for (const Sighting& s : sightings.all) inverse[s.square] += s.weight * place(s) * place(s).transpose();
    for (Eigen::Matrix3d& m : inverse) m = m.inverse().eval();
  }

  std::vector<Eigen::Vector3d> solve(const Sightings& sightings, std::span<const Correction> corrections) const {
    std::vector<Eigen::Vector3d> planes(inverse.size(), Eigen::Vector3d::Zero());
    for (const Sighting& s : sightings.all)
      planes[s.square] += s.weight * (s.z_m + lever(s).dot(corrections[s.scan])) * place(s);
    for (std::size_t k = 0; k < planes.size(); ++k) planes[k] = inverse[k] * planes[k];
    return planes;
  }
};

double off_plane_m(const Sighting& s, std::span<const Correction> corrections,
                   std::span<const Eigen::Vector3d> planes) {
  return s.z_m + lever(s).dot(corrections[s.scan]) - planes[s.square].dot(place(s));
}

// The corrections that make weighted least squares of the sightings' distances from their planes, of what corrections
// change from scan to scan, and of the first one.
std::vector<Correction> solve(const Sightings& sightings, std::span<const Correction> so_far) {
  const std::size_t scans = so_far.size();
  const Planes eliminated(sightings);
  const std::vector<Correction> none(scans, Correction::Zero());
  const std::vector<Eigen::Vector3d> planes = eliminated.solve(sightings, none);

  std::vector<Eigen::Triplet<double>> entries;  // lower triangle
  Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * scans));
  std::vector<Eigen::Matrix3d> row(scans);
  std::vector<std::size_t> met;  // columns of the row that hold something
  std::vector<char> is_met(scans, 0);
  auto next = sightings.all.begin();
  for (std::size_t i = 0; i < scans; ++i) {
    const auto add = [&](std::size_t k, const Eigen::Matrix3d& block) {
      if (!is_met[k]) row[k].setZero(), met.push_back(k), is_met[k] = 1;
      row[k] += block;
    };
    Correction b = Correction::Zero();
    for (; next != sightings.all.end() && next->scan == i; ++next) {
      const Sighting& s = *next;
      const Eigen::Vector3d shared = eliminated.inverse[s.square] * place(s);
      add(i, s.weight * lever(s) * lever(s).transpose());
      for (const std::size_t o : sightings.by_square[s.square]) {
        const Sighting& other = sightings.all[o];
        if (other.scan > i) break;
        add(other.scan, -s.weight * other.weight * shared.dot(place(other)) * lever(s) * lever(other).transpose());
      }
      b -= s.weight * off_plane_m(s, none, planes) * lever(s);
    }
    const auto pull = [&](double sigma) { return kNoise_m * kNoise_m / (sigma * sigma); };
    const Correction step(pull(kStepHeight_m), pull(kStepTilt), pull(kStepTilt));
    if (i == 0) add(0, Correction::Constant(pull(kFirstPose)).asDiagonal());
    if (i > 0) {
      add(i, step.asDiagonal());
      add(i - 1, (-step).asDiagonal());
      b += step.cwiseProduct(so_far[i - 1] - so_far[i]);
    }
    if (i + 1 < scans) {
      add(i, step.asDiagonal());
      b += step.cwiseProduct(so_far[i + 1] - so_far[i]);
    }
    for (const std::size_t k : met) {
      is_met[k] = 0;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          entries.emplace_back(static_cast<int>(3 * i) + r, static_cast<int>(3 * k) + c, row[k](r, c));
    }
    met.clear();
    right.segment<3>(static_cast<Eigen::Index>(3 * i)) = b;
  }
  Eigen::SparseMatrix<double> matrix(right.size(), right.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd solution = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
  std::vector<Correction> corrections(scans);
  for (std::size_t i = 0; i < scans; ++i) corrections[i] = solution.segment<3>(static_cast<Eigen::Index>(3 * i));
  return corrections;
}

// Raises the sensor by c[0] and tilts what it saw so that ground rises by c[1] along x and c[2] along y.
Pose corrected(const Pose& pose, const Correction& c) {
  // Rodrigues' formula about (p, q, 0), whose length is the tangent of the angle.
  const double p = c[2], q = -c[1], cosine = 1 / std::sqrt(1 + p * p + q * q), k = cosine * cosine / (1 + cosine);
  Pose turn;
  turn.rotation = {cosine + k * p * p, k * p * q,   cosine * q, k * p * q, cosine + k * q * q,
                   -cosine * p,        -cosine * q, cosine * p, cosine};
  Pose out = pose;
  out.rotation = turn.after(pose).rotation;
  out.place_m[2] += c[0];
  return out;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double smear_m(const Sightings& sightings, std::size_t scans) {
  const std::vector<Correction> none(scans, Correction::Zero());
  const std::vector<Eigen::Vector3d> planes = Planes(sightings).solve(sightings, none);
  std::vector<double> ranges;
  for (const auto& seen : sightings.by_square) {
    if (seen.size() < kScansForSmear) continue;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::size_t i : seen) {
      const double off = off_plane_m(sightings.all[i], none, planes);
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
    std::int64_t x = 0, y = 0, z = 0, zz = 0, n = 0;
  };
  constexpr auto kPatch_mm = static_cast<std::int64_t>(kPatch_m * 1000);
  constexpr double kRange_mm = kGroundRange_m * 1000;
  std::map<Square, Sum> sums;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != Label::kTerrain) continue;
    const std::int64_t x = points.x_mm[i], y = points.y_mm[i];
    const auto along_x = static_cast<double>(x), along_y = static_cast<double>(y);
    if (along_x * along_x + along_y * along_y > kRange_mm * kRange_mm) continue;
    Sum& sum = sums[{floor_div(x, kPatch_mm), floor_div(y, kPatch_mm)}];
    const std::int64_t z = points.z_mm[i];
    sum = {sum.x + x, sum.y + y, sum.z + z, sum.zz + z * z, sum.n + 1};
  }
  std::vector<GroundPatch> patches;
  for (const auto& entry : sums) {
    const Sum& s = entry.second;
    const auto n = static_cast<double>(s.n), mean_mm = static_cast<double>(s.z) / n;
    if (static_cast<double>(s.zz) / n - mean_mm * mean_mm > kRoughest_m * kRoughest_m * 1e6) continue;
    const auto mean_m = [&](std::int64_t sum) { return static_cast<float>(static_cast<double>(sum) / (1000.0 * n)); };
    patches.push_back({mean_m(s.x), mean_m(s.y), mean_m(s.z)});
  }
  return patches;
}

AlignedPoses align_ground(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses,
                          Progress& progress) {
  constexpr std::uint64_t kSolves = kLinearisations * (1 + std::size(kScales_m));
  progress.begin("align", kSolves, "solves");
  const auto solve_next = [&](const Sightings& sightings, std::span<const Correction> so_far) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped");
    auto found = solve(sightings, so_far);
    progress.advance(1);
    return found;
  };
  AlignedPoses out;
  out.poses.assign(poses.begin(), poses.end());
  std::vector<Correction> total(poses.size(), Correction::Zero());
  for (int linearisation = 0; linearisation < kLinearisations; ++linearisation) {
    Sightings sightings = find_sightings(ground, out.poses);
    if (linearisation == 0) out.smear_before_m = smear_m(sightings, poses.size());
    if (sightings.all.empty()) return out;
    std::vector<Correction> found = solve_next(sightings, total);
    for (const double scale_m : kScales_m) {
      const std::vector<Eigen::Vector3d> planes = Planes(sightings).solve(sightings, found);
      for (Sighting& s : sightings.all) {
        const double off = off_plane_m(s, found, planes) / scale_m;
        s.weight = 1 / (1 + off * off);
      }
      found = solve_next(sightings, total);
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
      total[i] += found[i];
      out.poses[i] = corrected(out.poses[i], found[i]);
    }
  }
  out.smear_after_m = smear_m(find_sightings(ground, out.poses), poses.size());
  for (const Correction& c : total) {
    out.largest_m = std::max(out.largest_m, std::abs(c[0]));
    out.largest_slope = std::max(out.largest_slope, std::sqrt(c[1] * c[1] + c[2] * c[2]));
  }
  return out;
}

}  // namespace btms
