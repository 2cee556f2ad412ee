// The plants and other round things of all scenes.
#pragma once

#include "engine/scenes/object.h"
#include "engine/scenes/random.h"

namespace btms {

// A crown that lets a share of the pulses through to what is below.
inline Object tree(const Frame& place, Random& random, double low_m, double high_m, double opacity) {
  const double height = random.uniform(low_m, high_m), radius = height * random.uniform(0.18, 0.3);
  return {.form = Form::kDome,
          .label = SceneClass::kHighVegetation,
          .follows_ground = true,
          .frame = place,
          .half_s_m = radius,
          .half_t_m = radius,
          .height_m = height,
          .eaves_m = height * 0.6,
          .opacity = opacity,
          .scatter_m = height * 0.5};
}

inline Object bush(const Frame& place, Random& random) {
  const double radius = random.uniform(0.5, 1.6), height = random.uniform(0.3, 1.4);
  return {.form = Form::kDome,
          .label = SceneClass::kLowVegetation,
          .follows_ground = true,
          .frame = place,
          .half_s_m = radius,
          .half_t_m = radius,
          .height_m = height,
          .opacity = 0.75,
          .scatter_m = height * 0.7};
}

inline Object hedge(const Frame& place, Random& random, double half_length_m) {
  const double height = random.uniform(0.4, 1.5);
  return {.form = Form::kSlab,
          .label = SceneClass::kLowVegetation,
          .follows_ground = true,
          .frame = place,
          .half_s_m = half_length_m,
          .half_t_m = random.uniform(0.25, 0.5),
          .height_m = height,
          .opacity = 0.9,
          .scatter_m = height * 0.6};
}

inline Object boulder(const Frame& place, Random& random, double largest_m) {
  const double radius = largest_m * random.uniform(0.3, 1);
  return {.form = Form::kDome,
          .label = SceneClass::kUnclassified,
          .follows_ground = true,
          .frame = place,
          .half_s_m = radius,
          .half_t_m = radius * random.uniform(0.6, 1),
          .height_m = radius * random.uniform(0.7, 1.3)};
}

}  // namespace btms
