#include "engine/scenes/route.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>

#include "engine/error.h"
#include "engine/scenes/body.h"

namespace btms {
namespace {

constexpr double kCell_m = 0.5;
constexpr double kHalfWidth_m = 0.85, kShy_m = 2.2;   // from things: never nearer, better not
constexpr double kLowest_m = 0.15, kHighest_m = 2.5;  // above the ground: what is in the way
constexpr double kSteepest = 1;
constexpr double kFarthest_m = 400;                   // from the middle of the area
constexpr double kLeast_m = 20;                       // to drive
constexpr double kBlock_m = 160, kLeastBlock_m = 50;  // of a block of streets: reach and radius of a loop round it
constexpr int kTries = 12, kSmoothings = 150;
constexpr std::int32_t kNone = -1;

struct Cell {
  bool blocked = false, street = false;
  double cost = 1;  // of a cell's width
};

struct Found {
  std::vector<std::int32_t> cells;  // none: no way
  double off_street = 0;            // share
};

class Plan {
 public:
  Plan(const World& world, const Box& box)
      : box_(box),
        columns_(static_cast<std::int32_t>((box.x1_m - box.x0_m) / kCell_m)),
        rows_(static_cast<std::int32_t>((box.y1_m - box.y0_m) / kCell_m)),
        cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {
    survey(world);
  }

  bool has_streets() const { return has_streets_; }

  // A loop round the hub, about radius_m away from it, or none.
  Found loop(const ScenePlace& hub, double radius_m) {
    hub_column_ = column(hub.x_m), hub_row_ = row(hub.y_m);
    hub_ = hub;
    radius_m_ = radius_m;
    if (hub_row_ < 1 || hub_row_ >= rows_ || hub_column_ < 0 || hub_column_ >= columns_) return {};
    // It starts east of the hub, above a cut that it must not cross, and ends below it.
    std::vector<std::int32_t> starts;
    for (std::int32_t c = hub_column_ + 1; c < columns_; ++c) {
      const std::int32_t above = index(c, hub_row_), below = index(c, hub_row_ - 1);
      if (usable(above) && usable(below) && ring_cost(above) < kForbidden && (at(above).street || !has_streets_))
        starts.push_back(above);
    }
    std::stable_sort(starts.begin(), starts.end(), [&](std::int32_t a, std::int32_t b) { return cost(a) < cost(b); });
    reached_.assign(cells_.size(), 0);
    int tries = 0;
    for (const std::int32_t start : starts) {
      if (reached_[static_cast<std::size_t>(start)] != 0) continue;  // as far as another start got
      if (++tries > kTries) break;
      const std::int32_t end = start - columns_;
      search(start, end, true);
      if (distance_[static_cast<std::size_t>(end)] < kForbidden) return path_to(end);
    }
    return {};
  }

  // To a place about length_m away, and back.
  Found there_and_back(const ScenePlace& hub, double length_m) {
    hub_ = hub;
    radius_m_ = 0;
    std::vector<std::int32_t> starts;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(cells_.size()); ++i)
      if (usable(i) && (at(i).street || !has_streets_)) starts.push_back(i);
    const auto away = [&](std::int32_t i) {
      const double dx = x(i) - hub.x_m, dy = y(i) - hub.y_m;
      return dx * dx + dy * dy;
    };
    std::stable_sort(starts.begin(), starts.end(), [&](std::int32_t a, std::int32_t b) { return away(a) < away(b); });
    reached_.assign(cells_.size(), 0);
    int tries = 0;
    for (const std::int32_t start : starts) {
      if (reached_[static_cast<std::size_t>(start)] != 0) continue;
      if (++tries > 5 * kTries) break;
      search(start, kNone, false);
      std::int32_t farthest = start;
      for (std::int32_t i = 0; i < static_cast<std::int32_t>(cells_.size()); ++i)
        if (length(i) <= length_m && length(i) > length(farthest)) farthest = i;
      if (length(farthest) < std::min(length_m / 2, kLeast_m)) continue;
      Found found = path_to(farthest);
      for (std::size_t k = found.cells.size() - 1; k-- > 1;) found.cells.push_back(found.cells[k]);
      return found;
    }
    return {};
  }

  // A smooth closed line through the cells that stays on free ground.
  std::vector<ScenePlace> smooth(const std::vector<std::int32_t>& cells) const {
    std::vector<ScenePlace> line;
    for (const std::int32_t c : cells) line.push_back({x(c), y(c)});
    const std::size_t n = line.size();
    for (int round = 0; round < kSmoothings; ++round)
      for (std::size_t k = 0; k < n; ++k) {
        const ScenePlace &a = line[(k + n - 1) % n], &b = line[(k + 1) % n];
        const ScenePlace middle{(a.x_m + 2 * line[k].x_m + b.x_m) / 4, (a.y_m + 2 * line[k].y_m + b.y_m) / 4};
        if (usable(index(column(middle.x_m), row(middle.y_m)))) line[k] = middle;
      }
    return line;
  }

 private:
  static constexpr double kForbidden = 1e9;

  std::int32_t column(double x_m) const { return static_cast<std::int32_t>(std::floor((x_m - box_.x0_m) / kCell_m)); }
  std::int32_t row(double y_m) const { return static_cast<std::int32_t>(std::floor((y_m - box_.y0_m) / kCell_m)); }
  std::int32_t index(std::int32_t c, std::int32_t r) const { return c + columns_ * r; }
  double x(std::int32_t i) const { return box_.x0_m + (i % columns_ + 0.5) * kCell_m; }
  double y(std::int32_t i) const { return box_.y0_m + (i / columns_ + 0.5) * kCell_m; }
  const Cell& at(std::int32_t i) const { return cells_[static_cast<std::size_t>(i)]; }
  bool usable(std::int32_t i) const { return !at(i).blocked; }
  double length(std::int32_t i) const { return length_[static_cast<std::size_t>(i)]; }

  void survey(const World& world);
  // What carries a vehicle in a cell, the ground there, and what stands on it.
  struct Places {
    std::vector<double> support, ground;
    std::vector<std::uint8_t> solid, near, leafy;
  };
  void mark(const Body& body, Places& places);

  // Keeps a loop about its radius away from the hub.
  double ring_cost(std::int32_t i) const {
    if (radius_m_ == 0) return 0;
    const double dx = x(i) - hub_.x_m, dy = y(i) - hub_.y_m, r = std::sqrt(dx * dx + dy * dy);
    if (r < 0.4 * radius_m_) return kForbidden;
    const double off = (r - radius_m_) / radius_m_;
    return (has_streets_ ? 0.5 : 4) * off * off;
  }
  double cost(std::int32_t i) const { return at(i).cost + ring_cost(i); }

  void search(std::int32_t start, std::int32_t goal, bool cut);
  Found path_to(std::int32_t goal) const;

  Box box_;
  std::int32_t columns_, rows_;
  std::vector<Cell> cells_;
  bool has_streets_ = false;
  ScenePlace hub_{};
  std::int32_t hub_column_ = 0, hub_row_ = 0;
  double radius_m_ = 0;
  std::vector<double> distance_, length_;
  std::vector<std::int32_t> parent_;
  std::vector<std::uint8_t> reached_;
};

void Plan::mark(const Body& body, Places& places) {
  const Object& o = body.object;
  const bool leaves = body.matter == Matter::kLeaves, deck = o.form == Form::kDeck;
  const Box b = o.bounds(leaves || deck ? 0 : kShy_m);
  for (std::int32_t r = std::max(0, row(b.y0_m)); r <= std::min(rows_ - 1, row(b.y1_m)); ++r)
    for (std::int32_t c = std::max(0, column(b.x0_m)); c <= std::min(columns_ - 1, column(b.x1_m)); ++c) {
      const std::int32_t i = index(c, r);
      const auto k = static_cast<std::size_t>(i);
      const double ground = places.ground[k], z = places.support[k];
      const auto in_the_way = [&](const std::optional<Extent>& e) {
        return e && e->low_m < z + kHighest_m && e->high_m > z + kLowest_m;
      };
      if (leaves || deck) {
        if (in_the_way(extent_at(body, x(i), y(i), ground))) (leaves ? places.leafy : places.solid)[k] = 1;
      } else if (in_the_way(extent_over(body, {ground, ground}))) {
        const bool inside = o.top(x(i), y(i)).has_value();
        if (inside || o.beside(x(i), y(i), kHalfWidth_m)) cells_[k].blocked = true;
        if (inside || o.beside(x(i), y(i), kShy_m)) places.near[k] = 1;
      }
    }
}

void Plan::survey(const World& world) {
  const std::size_t n = cells_.size();
  Places places{std::vector<double>(n), std::vector<double>(n), std::vector<std::uint8_t>(n),
                std::vector<std::uint8_t>(n), std::vector<std::uint8_t>(n)};
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(n); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto street = world.street_m(x(i), y(i));
    places.ground[k] = world.ground_m(x(i), y(i));
    places.support[k] = street.value_or(places.ground[k]);
    cells_[k].street = street.has_value();
    has_streets_ = has_streets_ || cells_[k].street;
  }
  for (const Body& body : bodies_in(world, box_)) mark(body, places);

  std::vector<double> slope(n);
  for (std::int32_t r = 0; r + 1 < rows_; ++r)
    for (std::int32_t c = 0; c + 1 < columns_; ++c) {
      const auto k = static_cast<std::size_t>(index(c, r));
      for (const std::size_t next : {k + 1, k + static_cast<std::size_t>(columns_)}) {
        const double s = std::abs(places.support[next] - places.support[k]) / kCell_m;
        slope[k] = std::max(slope[k], s);
        slope[next] = std::max(slope[next], s);
      }
    }
  const auto reach = static_cast<std::int32_t>(kShy_m / kCell_m);
  for (std::int32_t r = 0; r < rows_; ++r)
    for (std::int32_t c = 0; c < columns_; ++c) {
      const auto k = static_cast<std::size_t>(index(c, r));
      const bool border = c == 0 || r == 0 || c == columns_ - 1 || r == rows_ - 1;
      if (border) cells_[k].blocked = true;
      if (places.solid[k] == 0 && slope[k] <= kSteepest) continue;
      for (std::int32_t dr = -reach; dr <= reach; ++dr)
        for (std::int32_t dc = -reach; dc <= reach; ++dc) {
          const std::int32_t rr = r + dr, cc = c + dc;
          if (rr < 0 || cc < 0 || rr >= rows_ || cc >= columns_) continue;
          const double d2 = kCell_m * kCell_m * (dr * dr + dc * dc);
          const auto other = static_cast<std::size_t>(index(cc, rr));
          if (d2 <= kHalfWidth_m * kHalfWidth_m) cells_[other].blocked = true;
          places.near[other] = 1;
        }
    }
  for (std::size_t k = 0; k < n; ++k)
    cells_[k].cost += 2.0 * places.near[k] + 6.0 * places.leafy[k] + 6 * slope[k] * slope[k] +
                      (has_streets_ && !cells_[k].street ? 20 : 0);
}

// The cheapest paths from a cell to all others, or to the goal. `cut`: none crosses the line east of the hub.
void Plan::search(std::int32_t start, std::int32_t goal, bool cut) {
  const std::size_t n = cells_.size();
  distance_.assign(n, std::numeric_limits<double>::infinity());
  length_.assign(n, 0);
  parent_.assign(n, kNone);
  std::vector<std::uint8_t> done(n);
  using Entry = std::pair<double, std::int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  distance_[static_cast<std::size_t>(start)] = 0;
  open.emplace(0, start);
  while (!open.empty()) {
    const std::int32_t i = open.top().second;
    open.pop();
    const auto from = static_cast<std::size_t>(i);
    if (done[from] != 0) continue;
    done[from] = reached_[from] = 1;
    if (i == goal) return;
    const std::int32_t c = i % columns_, r = i / columns_;
    for (std::int32_t dr = -1; dr <= 1; ++dr)
      for (std::int32_t dc = -1; dc <= 1; ++dc) {
        if (dr == 0 && dc == 0) continue;
        const std::int32_t next = index(c + dc, r + dr);  // the border is blocked, so it exists
        const auto to = static_cast<std::size_t>(next);
        if (!usable(next) || done[to] != 0) continue;
        const bool crosses = (r == hub_row_ && dr == -1) || (r == hub_row_ - 1 && dr == 1);
        if (cut && crosses && std::max(c, c + dc) > hub_column_) continue;
        const double step = dr != 0 && dc != 0 ? 1.41421356 : 1;
        const double total = distance_[from] + step * (cost(i) + cost(next)) / 2;
        if (total >= distance_[to] || total >= kForbidden / 4) continue;
        distance_[to] = total;
        length_[to] = length_[from] + step * kCell_m;
        parent_[to] = i;
        open.emplace(total, next);
      }
  }
}

Found Plan::path_to(std::int32_t goal) const {
  Found found;
  for (std::int32_t i = goal; i != kNone; i = parent_[static_cast<std::size_t>(i)]) {
    found.cells.push_back(i);
    found.off_street += at(i).street ? 0 : 1;
  }
  std::reverse(found.cells.begin(), found.cells.end());
  found.off_street /= static_cast<double>(found.cells.size());
  return found;
}

// Round a block of a city: which one is the choice of the streets. Of other worlds the middle will do.
std::vector<ScenePlace> hubs_around(const ScenePlace& middle, bool streets) {
  constexpr double kHubStep_m = 35;
  const int reach = streets ? 2 : 0;
  std::vector<ScenePlace> hubs;
  for (int ring = 0; ring <= reach; ++ring)
    for (int j = -ring; j <= ring; ++j)
      for (int i = -ring; i <= ring; ++i)
        if (std::max(std::abs(i), std::abs(j)) == ring)
          hubs.push_back({middle.x_m + i * kHubStep_m, middle.y_m + j * kHubStep_m});
  return hubs;
}

}  // namespace

double support_m(const World& world, double x_m, double y_m) {
  const auto street = world.street_m(x_m, y_m);
  return street ? *street : world.ground_m(x_m, y_m);
}

std::vector<ScenePlace> plan_route(const World& world, const Box& area, double length_m) {
  const ScenePlace middle{(area.x0_m + area.x1_m) / 2, (area.y0_m + area.y1_m) / 2};
  const double half = std::min(std::min(area.x1_m - area.x0_m, area.y1_m - area.y0_m) / 2, kFarthest_m);
  if (half < kLeast_m / 2) throw Error(ErrorCode::kUsage, "the scene is too small to drive in; give more --points");
  const double wanted = std::clamp(0.8 * length_m, kLeast_m, 2 * 3.1415926 * 0.7 * half);
  const double radius = wanted / (2 * 3.1415926), reach = std::min(half, std::max(1.6 * radius + 10, kBlock_m));
  Plan plan(world, {middle.x_m - reach, middle.y_m - reach, middle.x_m + reach, middle.y_m + reach});

  Found best;
  double best_off = std::numeric_limits<double>::infinity();
  for (const ScenePlace& hub : hubs_around(middle, plan.has_streets())) {
    Found found = plan.loop(hub, plan.has_streets() ? std::max(radius, kLeastBlock_m) : radius);
    if (found.cells.empty() || (plan.has_streets() && found.off_street > 0.02)) continue;
    const double off = std::abs(static_cast<double>(found.cells.size()) * kCell_m / wanted - 1);
    if (off >= best_off) continue;
    best_off = off;
    best = std::move(found);
    if (off < 0.2 || wanted < 4 * kLeastBlock_m) break;  // a short drive closes no loop
  }
  if (best.cells.empty()) best = plan.there_and_back(middle, std::max(wanted / 2, kLeast_m));
  if (best.cells.empty())
    throw Error(ErrorCode::kUsage, "found no room to drive in this scene; give more --points, or another --seed");
  return plan.smooth(best.cells);
}

}  // namespace btms
