#include "engine/scenes/airborne.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "engine/scenes/object_grid.h"
#include "engine/scenes/random.h"
#include "engine/scenes/slanted.h"
#include "engine/scenes/truth.h"

namespace btms {
namespace {

constexpr std::int64_t kBlock_mm = 64'000;
constexpr double kRangeNoise_m = 0.02;  // on things
constexpr double kLowNoiseShare = 5e-6;
// Slanted pulses reach walls: this share of those that land this close to a building.
constexpr double kWallReach_m = 0.2, kWallShare = 0.3;

std::int64_t nearest(double v) { return static_cast<std::int64_t>(std::floor(v + 0.5)); }

// Whole millimetres of the map frame give the same local place wherever the origin is.
double local_m(double map_m, std::int64_t origin_mm) {
  const double mm = map_m * 1000 - static_cast<double>(origin_mm);
  return std::floor(mm * 1024 + 0.5) / 1024 / 1000;
}

struct Hit {
  double z_m;
  SceneClass label;
};

// Tops above one place, from the highest down.
struct Stack {
  struct Layer {
    double z_m, low_m;
    const Object* object;
  };
  std::array<Layer, 12> layers;
  std::size_t count = 0;

  // Keeps the highest; practically no pulse passes as many as there is room for.
  void insert(const Layer& layer) {
    if (count == layers.size() && layers.back().z_m >= layer.z_m) return;
    std::size_t i = count < layers.size() ? count++ : count - 1;
    for (; i > 0 && layers[i - 1].z_m < layer.z_m; --i) layers[i] = layers[i - 1];
    layers[i] = layer;
  }
};

// The top of an object in absolute height where it stands clear of the ground.
std::optional<double> top_z(const Object& o, double x_m, double y_m, double ground_m) {
  const std::optional<double> z = absolute_top(o, x_m, y_m, ground_m);
  return z && *z > ground_m + kClear_m ? z : std::nullopt;
}

// What a pulse that gets as far as `floor` returns from the objects above it.
Hit pulse(double x_m, double y_m, double ground_m, const Hit& floor, std::span<const Object> objects,
          std::span<const std::uint32_t> near, Random& random) {
  Stack stack;
  for (const std::uint32_t i : near) {
    const Object& o = objects[i];
    if (const auto z = top_z(o, x_m, y_m, ground_m); z && *z > floor.z_m) {
      const double low = std::max(floor.z_m, *z - o.scatter_m);
      stack.insert({*z, low, &o});
    } else if (!z && o.label == SceneClass::kBuilding && o.beside(x_m, y_m, kWallReach_m) &&
               random.chance(kWallShare)) {
      const double eaves = o.base_m + (o.eaves_m > 0 ? o.eaves_m : o.height_m);
      if (eaves > ground_m) stack.insert({random.uniform(ground_m, eaves), eaves, nullptr});
    }
  }
  for (std::size_t i = 0; i < stack.count; ++i) {
    const auto& [z, low, object] = stack.layers[i];
    if (object == nullptr) return {z, SceneClass::kBuilding};
    if (object->opacity < 1 && !random.chance(object->opacity)) continue;
    if (object->scatter_m == 0) return {z, object->label};
    const double u = random.uniform();
    return {z - (z - low) * u * u, object->label};
  }
  return floor;
}

// Where a slanted pulse ends if no plant is in its way.
struct Landing {
  std::int64_t x_mm;
  Hit hit;
};

Landing land(const World& world, std::span<const Object> solids, std::span<const std::uint32_t> near, const Aim& aim,
             std::int64_t x_mm) {
  const auto stop = stopped(world, solids, near, aim);
  if (!stop) return {x_mm, {aim.ground_m, SceneClass::kGround}};
  x_mm += nearest(aim.slant * stop->up_m * 1000);
  if (stop->object) return {x_mm, {aim.ground_m + stop->up_m, stop->object->label}};
  return {x_mm, {world.ground_m(static_cast<double>(x_mm) / 1000, aim.y_m), SceneClass::kGround}};  // a cliff
}

}  // namespace

AirborneScene::AirborneScene(const SceneOptions& options, std::unique_ptr<World> world)
    : world_(std::move(world)),
      survey_(world_->survey()),
      seed_(options.seed),
      density_per_m2_(options.density_per_m2.value_or(survey_.density_per_m2)) {
  if (!(density_per_m2_ >= 0.01 && density_per_m2_ <= 1e4))
    throw Error(ErrorCode::kUsage, "density " + std::to_string(density_per_m2_) + " is outside 0.01..10000 per m2");
  if (options.points == 0) throw Error(ErrorCode::kUsage, "a scene needs at least one point");
  const double edge_m = std::sqrt(static_cast<double>(options.points) / density_per_m2_);
  const double reach_m = kMaxHorizontal_mm / 1000.0 - edge_m;
  if (!(std::abs(options.origin_x_m) < reach_m && std::abs(options.origin_y_m) < reach_m))
    throw Error(ErrorCode::kUsage, "the scene reaches beyond the map frame");
  origin_x_mm_ = nearest(options.origin_x_m * 1000);
  origin_y_mm_ = nearest(options.origin_y_m * 1000);
  edge_mm_ = std::max<std::int64_t>(1, nearest(edge_m * 1000));
  blocks_per_row_ = static_cast<std::size_t>(ceil_div(edge_mm_, kBlock_mm));
}

double AirborneScene::width_m() const { return static_cast<double>(edge_mm_) / 1000; }
double AirborneScene::height_m() const { return width_m(); }
std::size_t AirborneScene::blocks() const { return blocks_per_row_ * blocks_per_row_; }

double AirborneScene::ground_z_m(double x_m, double y_m) const {
  return world_->ground_m(local_m(x_m, origin_x_mm_), local_m(y_m, origin_y_mm_));
}

SceneClass AirborneScene::cover(double x_m, double y_m) const {
  const double x = local_m(x_m, origin_x_mm_), y = local_m(y_m, origin_y_mm_), ground = world_->ground_m(x, y);
  std::vector<Object> objects;
  world_->place({x, y, x, y}, objects);
  Hit highest{-std::numeric_limits<double>::infinity(), SceneClass::kGround};
  for (const Object& o : objects) {
    const auto z = top_z(o, x, y, ground);
    if (z && *z > highest.z_m && o.label != SceneClass::kCeiling) highest = {*z, o.label};
  }
  return highest.label;
}

void AirborneScene::truth(std::span<const ScenePlace> places, std::span<PlaceTruth> truths) const {
  if (places.empty()) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  std::vector<ScenePlace> local(places.begin(), places.end());
  for (ScenePlace& p : local) {
    p = {local_m(p.x_m, origin_x_mm_), local_m(p.y_m, origin_y_mm_)};
    box = {std::min(box.x0_m, p.x_m), std::min(box.y0_m, p.y_m), std::max(box.x1_m, p.x_m), std::max(box.y1_m, p.y_m)};
  }
  const TruthBox known(*world_, box);
  for (std::size_t i = 0; i < local.size(); ++i) truths[i] = known.at(local[i].x_m, local[i].y_m);
}

void AirborneScene::generate(std::size_t block, std::vector<ScenePoint>& points) const {
  const auto column = static_cast<std::int64_t>(block % blocks_per_row_);
  const auto row = static_cast<std::int64_t>(block / blocks_per_row_);
  const std::int64_t x0 = column * kBlock_mm, y0 = row * kBlock_mm;
  const std::int64_t x1 = std::min(x0 + kBlock_mm, edge_mm_), y1 = std::min(y0 + kBlock_mm, edge_mm_);
  const auto mm = [](std::int64_t v) { return static_cast<double>(v) / 1000; };
  const Box box{mm(x0), mm(y0), mm(x1), mm(y1)};

  // Plumb pulses meet everything in turn; slanted ones first what is solid.
  const double reach = survey_.slanted ? kSlantReach_m : kWallReach_m;
  std::vector<Object> objects, solids;
  world_->place(box.grown(reach * 2), objects);
  if (survey_.slanted) {
    const auto middle = std::stable_partition(objects.begin(), objects.end(), [](auto& o) { return !is_solid(o); });
    solids.assign(middle, objects.end());
    objects.erase(middle, objects.end());
  }
  const Box wide = survey_.slanted ? box.grown(reach) : box;
  const ObjectGrid grid(wide, objects, kWallReach_m), solid_grid(wide, solids, reach);

  const double per_m = std::sqrt(density_per_m2_), width = box.x1_m - box.x0_m, height = box.y1_m - box.y0_m;
  const std::int64_t lines = std::max<std::int64_t>(1, nearest(height * per_m));
  // Counted from the area, so that thin blocks at the border keep the density.
  const std::int64_t pulses = nearest(density_per_m2_ * width * height / static_cast<double>(lines));
  const double step_x = static_cast<double>(x1 - x0) / static_cast<double>(std::max<std::int64_t>(1, pulses));
  const double step_y = static_cast<double>(y1 - y0) / static_cast<double>(lines);

  Random random(hash_at(seed_ ^ 0x5ca1ab1eu, column, row));
  for (std::int64_t line = 0; line < lines; ++line)
    for (std::int64_t p = 0; p < pulses; ++p) {
      const std::int64_t along = line % 2 == 0 ? p : pulses - 1 - p;
      const std::uint64_t jitter = random.bits();
      const double jx = static_cast<double>(jitter >> 32) * 0x1p-32;
      const double jy = static_cast<double>(jitter & 0xffffffffu) * 0x1p-32;
      const std::int64_t x_mm = x0 + static_cast<std::int64_t>((static_cast<double>(along) + jx) * step_x);
      const std::int64_t y_mm = y0 + static_cast<std::int64_t>((static_cast<double>(line) + jy) * step_y);
      const double x = mm(x_mm), y = mm(y_mm), ground = world_->ground_m(x, y);
      Landing landing{x_mm, {ground, SceneClass::kGround}};
      if (survey_.slanted) {
        const double share = world_->from_below(x, y);
        const bool decks = share == 0 || !random.chance(share);
        const auto near = solid_grid.near(x, y);
        landing = land(*world_, solids, near, {x, y, ground, slant(x), decks}, x_mm);
        // Nothing lies outside the area.
        if (landing.x_mm < 0 || landing.x_mm >= edge_mm_)
          landing = land(*world_, solids, near, {x, y, ground, 0, decks}, x_mm);
      }
      const double hit_x = mm(landing.x_mm), below = landing.x_mm == x_mm ? ground : world_->ground_m(hit_x, y);
      Hit hit = pulse(hit_x, y, below, landing.hit, objects, grid.near(hit_x, y), random);
      if (random.chance(kLowNoiseShare)) hit = {below - random.uniform(0.5, 5), SceneClass::kLowNoise};
      const double deviation = hit.label == SceneClass::kGround ? survey_.deviation_m : kRangeNoise_m;
      points.push_back({landing.x_mm + origin_x_mm_, y_mm + origin_y_mm_,
                        static_cast<std::int32_t>(nearest((hit.z_m + deviation * random.bell()) * 1000)), hit.label});
    }
}

}  // namespace btms
