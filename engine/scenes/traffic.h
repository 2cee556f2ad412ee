// Cars and lorries of all scenes, lengthwise along s.
#pragma once

#include "engine/scenes/object.h"
#include "engine/scenes/random.h"

namespace btms {

inline Object car(const Frame& place, Random& random) {
  Object o{.form = Form::kCar, .label = SceneClass::kVehicle, .follows_ground = true, .frame = place};
  o.half_s_m = random.uniform(1.9, 2.4);
  o.half_t_m = random.uniform(0.8, 0.95);
  o.height_m = random.uniform(1.4, 1.65);
  o.eaves_m = o.height_m - random.uniform(0.4, 0.6);
  if (random.chance(0.08)) o.eaves_m = o.height_m = random.uniform(2, 2.9);  // vans
  return o;
}

inline Object lorry(const Frame& place, Random& random) {
  Object o{.label = SceneClass::kVehicle, .follows_ground = true, .frame = place};
  o.half_s_m = random.uniform(5, 8);
  o.half_t_m = 1.25;
  o.height_m = random.uniform(3.4, 4);
  return o;
}

}  // namespace btms
