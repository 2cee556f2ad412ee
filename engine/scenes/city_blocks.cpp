// What stands in a block of the city, by its kind. All places are in the block's own frame: s east, t north of its
// centre. No call draws two numbers in its arguments: their order would be the compiler's choice.
#include <algorithm>
#include <cmath>

#include "engine/scenes/city.h"
#include "engine/scenes/greenery.h"
#include "engine/scenes/traffic.h"

namespace btms {
namespace {

class Builder {
 public:
  Builder(const Plot& plot, Placer& placer) : plot_(plot), placer_(placer), random_(plot.seed) {}

  void build() {
    switch (plot_.kind) {
      case BlockKind::kCourtyard:
        courtyard();
        break;
      case BlockKind::kSlabs:
        slabs();
        break;
      case BlockKind::kHouses:
        houses();
        break;
      case BlockKind::kHalls:
        halls();
        break;
      case BlockKind::kTower:
        tower();
        break;
      case BlockKind::kPark:
        park();
        break;
    }
    kerbs();
  }

 private:
  // A rectangle of the block by its sides.
  struct Rect {
    double s0, t0, s1, t1;
    double width() const { return s1 - s0; }
    double depth() const { return t1 - t0; }
    Rect inset(double m) const { return {s0 + m, t0 + m, s1 - m, t1 - m}; }
  };

  Rect all() const { return {-plot_.half_s_m, -plot_.half_t_m, plot_.half_s_m, plot_.half_t_m}; }
  Frame at(double s, double t) const { return plot_.frame.moved(s, t); }
  Frame somewhere(const Rect& r) {
    const double s = random_.uniform(r.s0, r.s1);
    return at(s, random_.uniform(r.t0, r.t1));
  }

  // `across`: the ridge runs north instead of east.
  void building(const Rect& r, Form form, double height_m, bool across = false) {
    Object o{.form = form, .label = SceneClass::kBuilding};
    o.frame = plot_.frame.moved((r.s0 + r.s1) / 2, (r.t0 + r.t1) / 2, across ? 0 : 1, across ? 1 : 0);
    o.half_s_m = (across ? r.depth() : r.width()) / 2;
    o.half_t_m = (across ? r.width() : r.depth()) / 2;
    o.height_m = height_m;
    if (form == Form::kGable || form == Form::kHip)
      o.eaves_m = height_m - std::min(o.half_t_m * random_.uniform(0.5, 0.95), 0.6 * height_m);
    if (form == Form::kSawtooth) o.eaves_m = height_m - 2.2;
    if (form == Form::kSlab && random_.chance(0.6) && r.width() > 8) {
      o.rim_width_m = 0.35;
      o.rim_height_m = random_.uniform(0.3, 0.9);
    }
    placer_.add(o);
    if (form != Form::kSlab) return;
    const int boxes = static_cast<int>(r.width() * r.depth() / 250);  // lift heads, ventilation
    for (int k = 0; k < boxes; ++k) {
      const double s = random_.uniform(r.s0 + 3, r.s1 - 3), t = random_.uniform(r.t0 + 3, r.t1 - 3);
      Object box = o;
      box.rim_width_m = 0;
      box.half_s_m = random_.uniform(0.6, 2);
      box.half_t_m = random_.uniform(0.6, 2);
      box.height_m = height_m + random_.uniform(0.8, 3);
      // It stands on the roof, whose base is the ground at the roof's centre.
      box.frame = at(s, t);
      placer_.add_on(box, o);
    }
  }

  // A street front: houses wall to wall. `across`: the front runs north.
  void front(const Rect& r, bool across, double typical_m) {
    const double length = across ? r.depth() : r.width();
    const int count = std::max(1, static_cast<int>(length / random_.uniform(13, 22)));
    double from = 0;
    for (int k = 0; k < count; ++k) {
      const double to = k + 1 == count ? length : length * (k + 1 + random_.uniform(-0.2, 0.2)) / count;
      const Rect house = across ? Rect{r.s0, r.t0 + from, r.s1, r.t0 + to} : Rect{r.s0 + from, r.t0, r.s0 + to, r.t1};
      const bool flat = random_.chance(0.5);
      building(house, flat ? Form::kSlab : Form::kGable, typical_m + random_.uniform(-3, 4) + (flat ? 0 : 3), across);
      from = to;
    }
  }

  void courtyard() {
    const Rect r = all();
    const double d = random_.uniform(13, 16), typical = random_.uniform(12, 19);
    front({r.s0, r.t0, r.s1, r.t0 + d}, false, typical);
    front({r.s0, r.t1 - d, r.s1, r.t1}, false, typical);
    front({r.s0, r.t0 + d, r.s0 + d, r.t1 - d}, true, typical);
    front({r.s1 - d, r.t0 + d, r.s1, r.t1 - d}, true, typical);
    const Rect yard = r.inset(d + 1.5);
    if (random_.chance(0.3)) building({-9, -6, 9, 8}, Form::kSlab, random_.uniform(3.2, 5));
    for (int k = 0; k < 3; ++k) {
      const double s = random_.uniform(yard.s0, yard.s1 - 5);
      building({s, yard.t0 + 0.3, s + 4.5, yard.t0 + 3.5}, Form::kSlab, 2.6);
    }
    garden(yard, 9, 8, 5);
  }

  void slabs() {
    const Rect r = all().inset(4);
    const int count = std::max(1, static_cast<int>(r.depth() / 23));
    const double pitch = r.depth() / count;
    for (int k = 0; k < count; ++k) {
      const double t = r.t0 + k * pitch, shift = random_.uniform(0, 8), depth = random_.uniform(12, 15);
      const int storeys = 4 + random_.below(8);
      building({r.s0 + shift, t, r.s1 - 8 + shift, t + depth}, Form::kSlab, storeys * 3.0);
      parking(r.s0 + 6, t + 18, r.width() - 12);
      garden({r.s0, t + 16, r.s1, t + pitch}, 4, 4, 3);
    }
  }

  void houses() {
    const Rect r = all();
    const int columns = std::max(1, static_cast<int>(r.width() / 17)),
              rows = std::max(1, static_cast<int>(r.depth() / 20));
    const double w = r.width() / columns, d = r.depth() / rows;
    for (int k = 0; k < columns * rows; ++k) {
      const int column = k % columns, row = k / columns;
      const Rect lot{r.s0 + w * column, r.t0 + d * row, r.s0 + w * (column + 1), r.t0 + d * (row + 1)};
      const double s = lot.s0 + random_.uniform(1.5, 3), t = lot.t0 + random_.uniform(2.5, 5);
      const double width = random_.uniform(9.5, 12), depth = random_.uniform(9, 12);
      const int roof = random_.below(4);
      const Rect house{s, t, s + width, t + depth};
      const bool across = random_.chance(0.5);
      if (roof == 0)
        building(house, Form::kSlab, random_.uniform(3.2, 6.5));
      else
        building(house, roof == 1 ? Form::kHip : Form::kGable, random_.uniform(7, 9.5), across);
      if (random_.chance(0.6)) building({s + width, t, s + width + 3.2, t + 6}, Form::kSlab, 2.7);
      if (random_.chance(0.75)) placer_.add(hedge(at((lot.s0 + lot.s1) / 2, lot.t0 + 0.8), random_, w / 2 - 1.2));
      if (random_.chance(0.75))
        placer_.add(hedge(plot_.frame.moved(lot.s0 + 0.6, (lot.t0 + lot.t1) / 2, 0, 1), random_, d / 2 - 1.2));
      garden({lot.s0 + 2, t + depth + 1, lot.s1 - 2, lot.t1 - 1}, 1 + random_.below(2), 3, 0);
    }
  }

  void halls() {
    const Rect r = all().inset(4);
    const double width = std::min(60.0, r.width()), split = r.t0 + r.depth() * random_.uniform(0.5, 0.8);
    const Form form = random_.chance(0.2) ? Form::kSawtooth : Form::kSlab;
    building({r.s0, r.t0, r.s0 + width, split - 4}, form, random_.uniform(7.5, 12));
    if (random_.chance(0.6)) {
      const double second = width * random_.uniform(0.7, 1);
      building({r.s0, split, r.s0 + second, r.t1 - 3}, Form::kSlab, random_.uniform(6.5, 9));
    } else {
      for (double t = split; t < r.t1; t += 8) parking(r.s0, t, width);
    }
    const Rect side{r.s0 + width + 3, r.t0, r.s1, r.t1};
    if (side.width() > 14) building({side.s0, r.t0, side.s1, r.t0 + 30}, Form::kSlab, random_.uniform(5, 7));
    garden({side.s0, r.t0 + 32, side.s1, r.t1}, 5, 5, 2);
  }

  void tower() {
    building({-24, -14, 20, 24}, Form::kSlab, random_.uniform(4.5, 6));
    building({-12, -6, 12, 16}, Form::kSlab, random_.uniform(38, 75));
    garden({-plot_.half_s_m + 8, -plot_.half_t_m + 2, plot_.half_s_m - 2, -16}, 6, 6, 4);
  }

  void park() {
    const Rect r = all().inset(1);
    building({12, -4, 20, 4}, Form::kHip, 5.5);
    garden(r, 60, 30, 10);
  }

  void garden(const Rect& r, int trees, int bushes, int hedges) {
    if (r.width() < 3 || r.depth() < 3) return;
    for (int k = 0; k < trees; ++k) placer_.add(tree(somewhere(r), random_, 5, 17, 0.75));
    for (int k = 0; k < bushes; ++k) placer_.add(bush(somewhere(r), random_));
    for (int k = 0; k < hedges; ++k) {
      const Frame place = somewhere(r.inset(1));
      placer_.add(hedge(place, random_, random_.uniform(2, 7)));
    }
  }

  void park_car(const Frame& place) { placer_.add(car(place, random_)); }

  // Cars side by side, nose to the south.
  void parking(double s, double t, double length_m) {
    for (double p = 0; p < length_m; p += 2.7)
      if (random_.chance(0.6)) park_car(plot_.frame.moved(s + p, t, 0, 1));
  }

  // Parked cars and trees along the four streets.
  void kerbs() {
    const bool planted = random_.chance(0.6);
    const double hs = plot_.half_s_m, ht = plot_.half_t_m;
    const Street* streets[4] = {&plot_.west, &plot_.east, &plot_.south, &plot_.north};
    for (int side = 0; side < 4; ++side) {
      const bool runs_north = side < 2;
      const double sign = side % 2 == 0 ? -1 : 1, half = runs_north ? ht : hs, off = runs_north ? hs : ht;
      const auto place = [&](double run, double out) {
        const double far = sign * (off + out);
        return runs_north ? plot_.frame.moved(far, run, 0, 1) : plot_.frame.moved(run, far);
      };
      for (double p = -half; p < half; p += random_.uniform(5.4, 7)) {
        const bool parked = random_.chance(0.5);
        if (parked && !streets[side]->cutting) park_car(place(p, kPavement_m + 1.15));
      }
      for (double p = -half + 3; planted && p < half; p += random_.uniform(8, 13))
        placer_.add(tree(place(p, kPavement_m - 0.8), random_, 6, 11, 0.7));
    }
  }

  const Plot& plot_;
  Placer& placer_;
  Random random_;
};

}  // namespace

void fill_plot(const Plot& plot, Placer& placer) { Builder(plot, placer).build(); }

}  // namespace btms
