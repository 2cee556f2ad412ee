// Things that stand on the terrain: a footprint (a parallelogram or an ellipse) and the height of its top over it.
#pragma once

#include <array>
#include <optional>

#include "engine/scenes/scene.h"

namespace btms {

enum class Form : std::uint8_t {
  kSlab,      // flat top; a rim (parapet) along the edge
  kGable,     // two pitches, the ridge along s
  kHip,       // four pitches
  kSawtooth,  // a row of mono-pitches across s, each `eaves_m`..`height_m`
  kDeck,      // the four corner heights, bilinear; the rim (pavement) along t only
  kDome,      // half an ellipsoid: bush, boulder
  kCar,       // bonnet and cabin
};

// Local coordinates of an object or a group of objects: s = s_x dx + s_y dy, t likewise, from a centre. The rows need
// not be orthogonal, so that a block can follow streets that meet at any angle.
struct Frame {
  double x_m = 0, y_m = 0;
  double s_x = 1, s_y = 0, t_x = 0, t_y = 1;

  // The same axes around the place (s, t), turned by the unit vector (c, d).
  Frame moved(double s_m, double t_m, double c = 1, double d = 0) const;
};

struct Box {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0;

  Box grown(double m) const { return {x0_m - m, y0_m - m, x1_m + m, y1_m + m}; }
  bool meets(const Box& o) const { return x0_m <= o.x1_m && o.x0_m <= x1_m && y0_m <= o.y1_m && o.y0_m <= y1_m; }
};

struct Object {
  Form form = Form::kSlab;
  SceneClass label = SceneClass::kUnclassified;
  bool follows_ground = false;  // heights count from the ground below each place, else from base_m
  Frame frame{};
  double half_s_m = 1, half_t_m = 1;
  double base_m = 0;    // the ground at the centre
  double height_m = 1;  // of the highest place of the top, above the base (without the rim)
  double eaves_m = 0;   // pitched forms: the lowest place of the top, above the base
  double rim_width_m = 0, rim_height_m = 0;
  double opacity = 1;                 // the share of pulses it stops
  double scatter_m = 0;               // returns come from up to this far below the top
  std::array<double, 4> corners_m{};  // kDeck: absolute heights at (s, t) = (-,-) (+,-) (-,+) (+,+)

  Box bounds(double margin_m = 0) const;
  // Height of the top above the base (kDeck: absolute) at a place, none outside the footprint.
  std::optional<double> top(double x_m, double y_m) const;
  // Whether a place is outside the footprint but this close to it (exact for rectangles).
  bool beside(double x_m, double y_m, double distance_m) const;
};

}  // namespace btms
