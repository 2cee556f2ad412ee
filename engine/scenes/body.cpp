#include "engine/scenes/body.h"

#include <algorithm>

#include "engine/scenes/slanted.h"

namespace btms {
namespace {

constexpr double kThinnest_m = 0.02;

bool is_plant(SceneClass c) { return c == SceneClass::kLowVegetation || c == SceneClass::kHighVegetation; }

Body body_of(const Object& o) {
  if (o.form == Form::kDeck) return {o, Matter::kPlate, kDeckThickness_m};
  if (o.opacity == 1) return {o, Matter::kSolid, 0};
  return {o, is_plant(o.label) ? Matter::kLeaves : Matter::kPlate, std::max(o.scatter_m, kThinnest_m)};
}

// As those of the forest are; from the air none is seen.
Body trunk_of(const Object& crown) {
  Object o = crown;
  o.half_s_m = o.half_t_m = 0.008 * crown.height_m + 0.05;
  o.height_m = 0.6 * crown.height_m;
  o.eaves_m = o.height_m - 0.1;
  o.opacity = 1;
  o.scatter_m = 0;
  return {o, Matter::kSolid, 0};
}

}  // namespace

std::vector<Body> bodies_in(const World& world, const Box& box) {
  std::vector<Object> objects;
  world.place(box, objects);
  std::vector<Body> bodies;
  for (const Object& o : objects) {
    bodies.push_back(body_of(o));
    if (o.label == SceneClass::kHighVegetation && o.opacity < 1) bodies.push_back(trunk_of(o));
  }
  return bodies;
}

std::optional<Extent> extent_at(const Body& body, double x_m, double y_m, double ground_m) {
  const auto top = absolute_top(body.object, x_m, y_m, ground_m);
  if (!top || *top <= ground_m + kClear_m) return std::nullopt;
  return Extent{body.matter == Matter::kSolid ? ground_m : std::max(ground_m, *top - body.thickness_m), *top};
}

Extent extent_over(const Body& body, const Extent& ground) {
  const Object& o = body.object;
  Extent tops{};
  if (o.form == Form::kDeck) {
    const auto [low, high] = std::minmax_element(o.corners_m.begin(), o.corners_m.end());
    tops = {*low, *high + o.rim_height_m};
  } else {
    const bool pitched = o.form != Form::kSlab;
    const Extent base = o.follows_ground ? ground : Extent{o.base_m, o.base_m};
    tops = {base.low_m + (pitched ? o.eaves_m : o.height_m),
            base.high_m + std::max(o.height_m, o.eaves_m) + o.rim_height_m};
  }
  return {body.matter == Matter::kSolid ? ground.low_m : std::max(ground.low_m, tops.low_m - body.thickness_m),
          tops.high_m};
}

}  // namespace btms
