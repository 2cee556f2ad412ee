#include "engine/scenes/surroundings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/scenes/bisection.h"
#include "engine/scenes/random.h"

namespace btms {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kCell_m = 0.25;
constexpr std::int64_t kBlockCells = 16;
constexpr double kBlock_m = kCell_m * kBlockCells;
constexpr double kMargin_m = 0.06;  // the ground between samples is this close to theirs, unless it is a step
constexpr double kStep_m = 0.07;    // between looks at the exact ground
constexpr int kHalvings = 14;
constexpr double kLeaf_m = 0.18;  // at most, the edge of a cube
constexpr double kPushed_m = 1;   // so far leaves give way

std::int64_t cell_of(double v, double edge) { return static_cast<std::int64_t>(std::floor(v / edge)); }

// Calls visit(i, j, t0, t1) for the squares of a lattice that the ray crosses in [from, to], in order, until it says
// true.
template <typename Visit>
void walk(const Ray& ray, double from_m, double to_m, double edge, Visit visit) {
  std::int64_t i = cell_of(ray.x_m + ray.dx * from_m, edge), j = cell_of(ray.y_m + ray.dy * from_m, edge);
  const std::int64_t step_i = ray.dx > 0 ? 1 : -1, step_j = ray.dy > 0 ? 1 : -1;
  const auto border = [edge](std::int64_t c, std::int64_t step, double at, double d) {
    return d == 0 ? kInfinity : (static_cast<double>(c + (step > 0 ? 1 : 0)) * edge - at) / d;
  };
  for (double t = from_m; t < to_m;) {
    const double ti = border(i, step_i, ray.x_m, ray.dx), tj = border(j, step_j, ray.y_m, ray.dy);
    const double end = std::min(std::min(ti, tj), to_m);
    if (end > t && visit(i, j, t, end)) return;
    t = std::max(t, end);
    (ti < tj ? i : j) += ti < tj ? step_i : step_j;
  }
}

// The part of [from, to] with |a + b t| <= half.
bool clip(double a, double b, double half, double& from, double& to) {
  if (b == 0) return std::abs(a) <= half;
  const double t0 = (-half - a) / b, t1 = (half - a) / b;
  from = std::max(from, std::min(t0, t1));
  to = std::min(to, std::max(t0, t1));
  return from <= to;
}

// The part of [from, to] above the footprint.
bool clip(const Object& o, const Ray& ray, double& from, double& to) {
  const Frame& f = o.frame;
  const double x = ray.x_m - f.x_m, y = ray.y_m - f.y_m;
  const double s = f.s_x * x + f.s_y * y, t = f.t_x * x + f.t_y * y;
  const double ds = f.s_x * ray.dx + f.s_y * ray.dy, dt = f.t_x * ray.dx + f.t_y * ray.dy;
  if (!clip(s, ds, o.half_s_m, from, to) || !clip(t, dt, o.half_t_m, from, to)) return false;
  if (o.form != Form::kDome) return true;
  const double a = s / o.half_s_m, b = t / o.half_t_m, da = ds / o.half_s_m, db = dt / o.half_t_m;
  const double p = da * da + db * db, q = a * da + b * db, discriminant = q * q - p * (a * a + b * b - 1);
  if (discriminant <= 0 || p == 0) return p == 0 && a * a + b * b < 1;
  const double root = std::sqrt(discriminant);
  from = std::max(from, (-q - root) / p);
  to = std::min(to, (-q + root) / p);
  return from <= to;
}

}  // namespace

Surroundings::Surroundings(const World& world, const Box& box)
    : world_(world),
      first_x_(cell_of(box.x0_m, kBlock_m) * kBlockCells),
      first_y_(cell_of(box.y0_m, kBlock_m) * kBlockCells),
      blocks_x_(cell_of(box.x1_m, kBlock_m) + 1 - first_x_ / kBlockCells),
      blocks_y_(cell_of(box.y1_m, kBlock_m) + 1 - first_y_ / kBlockCells),
      samples_x_(blocks_x_ * kBlockCells + 1),
      samples_y_(blocks_y_ * kBlockCells + 1) {
  sample_ground();
  place_targets();
}

void Surroundings::sample_ground() {
  ground_m_.resize(static_cast<std::size_t>(samples_x_ * samples_y_));
  for (std::int64_t j = 0; j < samples_y_; ++j)
    for (std::int64_t i = 0; i < samples_x_; ++i)
      ground_m_[sample(first_x_ + i, first_y_ + j)] = static_cast<float>(
          world_.ground_m(static_cast<double>(first_x_ + i) * kCell_m, static_cast<double>(first_y_ + j) * kCell_m));
  blocks_.resize(static_cast<std::size_t>(blocks_x_ * blocks_y_));
  for (std::int64_t bj = 0; bj < blocks_y_; ++bj)
    for (std::int64_t bi = 0; bi < blocks_x_; ++bi) {
      Extent e{kInfinity, -kInfinity};
      for (std::int64_t j = bj * kBlockCells; j <= (bj + 1) * kBlockCells; ++j)
        for (std::int64_t i = bi * kBlockCells; i <= (bi + 1) * kBlockCells; ++i) {
          const double z = static_cast<double>(ground_m_[sample(first_x_ + i, first_y_ + j)]);
          e = {std::min(e.low_m, z), std::max(e.high_m, z)};
        }
      blocks_[static_cast<std::size_t>(bj * blocks_x_ + bi)].ground = {e.low_m - kMargin_m, e.high_m + kMargin_m};
    }
}

Surroundings::Target Surroundings::target(const Body& body) const {
  const Object& o = body.object;
  Target t{.body = body, .bounds = {}};
  if (body.matter != Matter::kLeaves) {
    t.step_m = std::clamp(std::min(o.half_s_m, o.half_t_m) / 4, 0.03, 0.2);
    return t;
  }
  // A plumb ray through all of the leaves passes n cubes, each of them free with a probability whose n-th power is the
  // share that gets through; n is a power of two, so that square roots will do.
  double free = 1 - o.opacity;
  for (t.step_m = body.thickness_m; t.step_m > kLeaf_m; t.step_m /= 2) free = std::sqrt(free);
  t.leaf_share = 1 - free;
  t.seed = hash_at(0x1eaf, cell_of(o.frame.x_m, 0.001), cell_of(o.frame.y_m, 0.001));
  return t;
}

void Surroundings::place_targets() {
  const auto edge = [](std::int64_t cells) { return static_cast<double>(cells) * kCell_m; };
  const Box box{edge(first_x_), edge(first_y_), edge(first_x_ + samples_x_ - 1), edge(first_y_ + samples_y_ - 1)};
  for (const Body& body : bodies_in(world_, box)) targets_.push_back(target(body));

  // f(block, target) for the blocks under a target.
  const auto visit = [&](const auto& f) {
    for (std::uint32_t k = 0; k < targets_.size(); ++k) {
      const Box b = targets_[k].body.object.bounds();
      const auto clamped = [](double v, std::int64_t first, std::int64_t n) {
        return std::clamp(cell_of(v, kBlock_m) - first / kBlockCells, std::int64_t{0}, n - 1);
      };
      for (std::int64_t j = clamped(b.y0_m, first_y_, blocks_y_); j <= clamped(b.y1_m, first_y_, blocks_y_); ++j)
        for (std::int64_t i = clamped(b.x0_m, first_x_, blocks_x_); i <= clamped(b.x1_m, first_x_, blocks_x_); ++i)
          f(blocks_[static_cast<std::size_t>(j * blocks_x_ + i)], k);
    }
  };
  std::vector<Extent> ground(targets_.size(), {kInfinity, -kInfinity});
  visit([&](Block& b, std::uint32_t k) {
    ground[k] = {std::min(ground[k].low_m, b.ground.low_m), std::max(ground[k].high_m, b.ground.high_m)};
    ++b.targets_end;
  });
  std::uint32_t sum = 0;
  for (Block& b : blocks_) {
    b.targets_begin = sum;
    sum += b.targets_end;
    b.targets_end = b.targets_begin;
    b.high_m = b.ground.high_m;
  }
  items_.resize(sum);
  for (std::size_t k = 0; k < targets_.size(); ++k) targets_[k].bounds = extent_over(targets_[k].body, ground[k]);
  visit([&](Block& b, std::uint32_t k) {
    items_[b.targets_end++] = k;
    b.high_m = std::max(b.high_m, targets_[k].bounds.high_m);
  });
}

const Surroundings::Block* Surroundings::block(std::int64_t i, std::int64_t j) const {
  i -= first_x_ / kBlockCells;
  j -= first_y_ / kBlockCells;
  if (i < 0 || j < 0 || i >= blocks_x_ || j >= blocks_y_) return nullptr;  // by a rounding, at its border
  return &blocks_[static_cast<std::size_t>(j * blocks_x_ + i)];
}

double Surroundings::ground_hit(const Ray& ray, double from_m, double to_m) const {
  const auto below = [&](double t) {
    return ray.z_m + ray.dz * t <= world_.ground_m(ray.x_m + ray.dx * t, ray.y_m + ray.dy * t);
  };
  double hit = kInfinity;
  walk(ray, from_m, to_m, kCell_m, [&](std::int64_t i, std::int64_t j, double t0, double t1) {
    if (i < first_x_ || j < first_y_ || i + 1 >= first_x_ + samples_x_ || j + 1 >= first_y_ + samples_y_) return false;
    const std::size_t s = sample(i, j), n = s + static_cast<std::size_t>(samples_x_);
    const double high = static_cast<double>(
        std::max(std::max(ground_m_[s], ground_m_[s + 1]), std::max(ground_m_[n], ground_m_[n + 1])));
    if (ray.z_m + std::min(ray.dz * t0, ray.dz * t1) > high + kMargin_m) return false;
    const int looks = static_cast<int>((t1 - t0) / kStep_m) + 1;
    for (int k = 1; k <= looks; ++k) {
      const double t = k == looks ? t1 : t0 + (t1 - t0) * k / looks;
      if (!below(t)) continue;
      hit = entry<kHalvings>(t0 + (t1 - t0) * (k - 1) / looks, t, below);
      return true;
    }
    return false;
  });
  return hit;
}

double Surroundings::target_hit(const Target& target, const Ray& ray, double from_m, double to_m) const {
  if (!clip(target.body.object, ray, from_m, to_m)) return kInfinity;
  const auto in = [&](double t) {
    const double x = ray.x_m + ray.dx * t, y = ray.y_m + ray.dy * t, z = ray.z_m + ray.dz * t;
    if (z > target.bounds.high_m || z < target.bounds.low_m) return false;
    const auto extent = extent_at(target.body, x, y, world_.ground_m(x, y));
    return extent && z <= extent->high_m && z >= extent->low_m;
  };
  const double step = target.step_m;
  if (target.body.matter == Matter::kLeaves) {
    for (double k = std::ceil(std::max(from_m, kPushed_m) / step); k * step <= to_m; ++k) {
      const double t = k * step;
      const auto cube = [&](double v) { return cell_of(v, step); };
      const std::uint64_t h = hash_at(hash_at(target.seed, cube(ray.x_m + ray.dx * t), cube(ray.y_m + ray.dy * t)),
                                      cube(ray.z_m + ray.dz * t));
      if (unit(h) < target.leaf_share && in(t)) return t;
    }
    return kInfinity;
  }
  if (in(from_m)) return from_m;
  for (double before = from_m, t = from_m; t < to_m; before = t) {
    t = std::min(t + step, to_m);
    if (in(t)) return entry<kHalvings>(before, t, in);
  }
  return kInfinity;
}

std::optional<RayHit> Surroundings::first_hit(const Ray& ray, double range_m) const {
  std::optional<RayHit> hit;
  walk(ray, 0, range_m, kBlock_m, [&](std::int64_t i, std::int64_t j, double t0, double t1) {
    const Block* b = block(i, j);
    const double low = ray.z_m + std::min(ray.dz * t0, ray.dz * t1);
    if (b == nullptr || low > b->high_m) return false;
    double nearest = t1;
    if (low <= b->ground.high_m)
      if (const double t = ground_hit(ray, t0, t1); t <= t1) {
        hit = {t, nullptr, false};
        nearest = t;
      }
    const double high = ray.z_m + std::max(ray.dz * t0, ray.dz * t1);
    for (std::uint32_t k = b->targets_begin; k < b->targets_end; ++k) {
      const Target& target = targets_[items_[k]];
      if (low > target.bounds.high_m || high < target.bounds.low_m) continue;
      const double t = target_hit(target, ray, t0, nearest);
      if (t > nearest || t == kInfinity) continue;
      const double x = ray.x_m + ray.dx * t, y = ray.y_m + ray.dy * t, z = ray.z_m + ray.dz * t;
      const auto extent = extent_at(target.body, x, y, world_.ground_m(x, y));
      hit = {t, &target.body.object, target.body.matter == Matter::kPlate && extent && z > extent->high_m - 0.01};
      nearest = t;
    }
    return hit.has_value();
  });
  return hit;
}

}  // namespace btms
