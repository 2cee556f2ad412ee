#include "engine/scenes/drive.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/scenes/noise.h"
#include "engine/scenes/route.h"
#include "engine/scenes/surroundings.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

using Vector = std::array<double, 3>;

constexpr double kAxle_m = 1.3, kTrack_m = 0.75;  // half of a vehicle: from the middle to axles and wheels
constexpr double kBorder_m = 8;                   // between the path and the end of the scene's area
constexpr double kDriftLength_m = 40;             // how soon roll and pitch stray elsewhere

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector unit_vector(const Vector& v) {
  const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / norm, v[1] / norm, v[2] / norm};
}

// Sine and cosine of any angle within a turn.
struct Direction {
  double c, s;
};
Direction direction(double angle) {
  if (angle < 0) {
    const Direction d = direction(-angle);
    return {d.c, -d.s};
  }
  const double quarter = std::floor(angle / (kPi / 2)), rest = angle - quarter * (kPi / 2);
  const double c = cosine(rest), s = sine(rest);
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

std::vector<Vector> rays_of(const DriveOptions& o) {
  std::vector<Vector> rays;
  rays.reserve(static_cast<std::size_t>(o.beams) * static_cast<std::size_t>(o.azimuths));
  for (int b = 0; b < o.beams; ++b) {
    const double share = o.beams == 1 ? 0 : static_cast<double>(b) / (o.beams - 1);
    const Direction up = direction(radians(o.up_deg + (o.down_deg - o.up_deg) * share));
    for (int a = 0; a < o.azimuths; ++a) {
      const Direction turn = direction(2 * kPi * a / o.azimuths);
      rays.push_back({up.c * turn.c, up.c * turn.s, up.s});
    }
  }
  return rays;
}

// A closed line by the distance along it.
class Line {
 public:
  explicit Line(const std::vector<ScenePlace>& places) : places_(places) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      const ScenePlace &a = places[k], &b = places[(k + 1) % places.size()];
      ends_.push_back((k == 0 ? 0 : ends_.back()) +
                      std::sqrt((b.x_m - a.x_m) * (b.x_m - a.x_m) + (b.y_m - a.y_m) * (b.y_m - a.y_m)));
    }
  }
  ScenePlace at(double along_m) const {
    const double d = along_m - std::floor(along_m / ends_.back()) * ends_.back();
    const auto k = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(ends_.begin(), ends_.end(), d) - ends_.begin()), ends_.size() - 1);
    const double begin = k == 0 ? 0 : ends_[k - 1], t = (d - begin) / (ends_[k] - begin);
    const ScenePlace &a = places_[k], &b = places_[(k + 1) % places_.size()];
    return {a.x_m + (b.x_m - a.x_m) * t, a.y_m + (b.y_m - a.y_m) * t};
  }
  // The unit vector ahead, seen over the length of the vehicle.
  ScenePlace ahead(double along_m) const {
    for (const double reach : {kAxle_m, 0.01}) {
      const ScenePlace a = at(along_m - (reach == kAxle_m ? reach : 0)), b = at(along_m + reach);
      const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m, norm = std::sqrt(dx * dx + dy * dy);
      if (norm > 0.001) return {dx / norm, dy / norm};
    }
    return {1, 0};  // turning on the spot
  }

 private:
  const std::vector<ScenePlace>& places_;
  std::vector<double> ends_;
};

Box drivable_area(const Scene& scene) {
  return {kBorder_m, kBorder_m, scene.width_m() - kBorder_m, scene.height_m() - kBorder_m};
}

// Upright above the ground below the four wheels; local metres.
Pose standing(const World& world, const ScenePlace& p, const ScenePlace& ahead, double height_m) {
  const auto wheel = [&](double along, double aside) {
    return support_m(world, p.x_m + along * ahead.x_m - aside * ahead.y_m,
                     p.y_m + along * ahead.y_m + aside * ahead.x_m);
  };
  const double front_left = wheel(kAxle_m, kTrack_m), front_right = wheel(kAxle_m, -kTrack_m);
  const double rear_left = wheel(-kAxle_m, kTrack_m), rear_right = wheel(-kAxle_m, -kTrack_m);
  const double climb = (front_left + front_right - rear_left - rear_right) / (4 * kAxle_m);
  const double bank = (front_left + rear_left - front_right - rear_right) / (4 * kTrack_m);
  const Vector forward = unit_vector({ahead.x_m, ahead.y_m, climb});
  const Vector up = unit_vector(cross(forward, {-ahead.y_m, ahead.x_m, bank})), left = cross(up, forward);
  const double ground = (front_left + front_right + rear_left + rear_right) / 4;
  return {{forward[0], left[0], up[0], forward[1], left[1], up[1], forward[2], left[2], up[2]},
          {p.x_m + height_m * up[0], p.y_m + height_m * up[1], ground + height_m * up[2]}};
}

// The pose with the sensor's nose lifted and its left side lifted.
Pose tilted(const Pose& pose, double pitch, double roll) {
  const Direction p = direction(pitch), r = direction(roll);
  const Vector forward = pose.turned({p.c, 0, p.s});
  const Vector left = pose.turned({-p.s * r.s, r.c, p.c * r.s});
  const Vector up = pose.turned({-p.s * r.c, -r.s, p.c * r.c});
  return {{forward[0], left[0], up[0], forward[1], left[1], up[1], forward[2], left[2], up[2]}, pose.place_m};
}

struct Look {
  std::uint32_t label;
  double reflectance;
};
Look look_of(const World& world, const Ray& ray, const RayHit& hit) {
  if (hit.object == nullptr) {
    const bool street = world.street_m(ray.x_m + ray.dx * hit.range_m, ray.y_m + ray.dy * hit.range_m).has_value();
    return street ? Look{40, 0.22} : Look{72, 0.3};
  }
  switch (hit.object->label) {
    case SceneClass::kLowVegetation:
      return {70, 0.35};
    case SceneClass::kHighVegetation:
      return hit.object->opacity < 1 ? Look{70, 0.35} : Look{71, 0.3};
    case SceneClass::kBuilding:
      return {50, 0.4};
    case SceneClass::kBridgeDeck:
      return hit.on_top ? Look{40, 0.25} : Look{52, 0.4};
    case SceneClass::kVehicle:
      return {10, 0.55};
    case SceneClass::kCeiling:
      return {52, 0.6};
    default:
      return {99, 0.3};
  }
}

}  // namespace

Drive::Drive(std::unique_ptr<World> world, const Box& area, std::uint64_t seed, const DriveOptions& drive)
    : options_(drive), seed_(seed), world_(std::move(world)), rays_(rays_of(drive)) {
  make_poses(plan_route(*world_, area, static_cast<double>(drive.scans) * drive.step_m));
  make_drift();
}

Drive::Drive(const SceneOptions& scene, const DriveOptions& drive)
    : Drive(make_world(scene.name, scene.seed), drivable_area(*Scene::create(scene)), scene.seed, drive) {
  const auto area = Scene::create(scene);
  for (std::vector<Pose>* poses : {&poses_, &drifting_})
    for (Pose& pose : *poses) {
      pose.place_m[0] += area->origin_x_m();
      pose.place_m[1] += area->origin_y_m();
    }
}

void Drive::make_poses(const std::vector<ScenePlace>& route) {
  const Line line(route);
  for (std::size_t i = 0; i < options_.scans; ++i) {
    const double along = static_cast<double>(i) * options_.step_m;
    poses_.push_back(standing(*world_, line.at(along), line.ahead(along), options_.sensor_height_m));
    places_.push_back(poses_.back().place_m);
  }
}

void Drive::make_drift() {
  const Noise pitch(hash_at(seed_, 0xd81f7, 1), kDriftLength_m), roll(hash_at(seed_, 0xd81f7, 2), kDriftLength_m);
  const double strength = radians(options_.drift_deg);
  double height = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const double along = static_cast<double>(i) * options_.step_m;
    const double grown = strength * fade(clamp_unit(along / kDriftLength_m));  // none at the start
    const double nose = grown * pitch.at(along), side = grown * roll.at(along);
    if (i > 0) height += nose * options_.step_m;
    Pose pose = tilted(poses_[i], nose, side);
    pose.place_m[2] += height;
    drifting_.push_back(pose);
  }
}

void Drive::scan(std::size_t first, std::size_t last, std::span<std::vector<DrivePoint>> scans) const {
  if (first >= last) return;
  Box box{places_[first][0], places_[first][1], places_[first][0], places_[first][1]};
  for (std::size_t i = first; i < last; ++i) {
    const Vector& p = places_[i];
    box = {std::min(box.x0_m, p[0]), std::min(box.y0_m, p[1]), std::max(box.x1_m, p[0]), std::max(box.y1_m, p[1])};
  }
  const Surroundings around(*world_, box.grown(options_.range_m));
  for (std::size_t i = first; i < last; ++i) {
    Random random(hash_at(seed_ ^ 0x5ca9, static_cast<std::int64_t>(i)));
    const Vector& p = places_[i];
    for (const Vector& in_sensor : rays_) {
      const Vector d = poses_[i].turned(in_sensor);
      const Ray ray{p[0], p[1], p[2], d[0], d[1], d[2]};
      const auto hit = around.first_hit(ray, options_.range_m);
      if (!hit) continue;
      const double range = hit->range_m + options_.noise_m * random.bell();
      const Look look = look_of(*world_, ray, *hit);
      scans[i - first].push_back({static_cast<float>(range * in_sensor[0]), static_cast<float>(range * in_sensor[1]),
                                  static_cast<float>(range * in_sensor[2]),
                                  static_cast<float>(std::clamp(look.reflectance + 0.04 * random.bell(), 0.0, 1.0)),
                                  look.label});
    }
  }
}

}  // namespace btms
