#include "engine/terrain/span.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace btms {
namespace {

constexpr std::int32_t kLeastStrip = 2;     // squares of a strip with a height
constexpr std::int32_t kLeastProfiles = 3;  // through a sure square
// A span is where at least half of the squares within so many rings are sure: a deck has sides, not just two walls that
// happen to face each other. Around it one lesser profile is enough.
constexpr std::int32_t kRings = 2;
constexpr std::int32_t kLeastSure = 13;
constexpr std::int32_t kLeastShare = 3;  // a third of a sure drop is the least one

// In half squares: eight lines, so that one of them crosses a strip almost squarely.
struct Direction {
  std::int32_t col, row;
};
constexpr Direction kDirections[] = {{2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {-1, 2}, {-2, 2}, {-2, 1}};

Cell moved(Cell c, const Direction& d, std::int32_t k) {
  return {c.col + static_cast<std::int32_t>(floor_div(std::int64_t{k} * d.col + 1, 2)),
          c.row + static_cast<std::int32_t>(floor_div(std::int64_t{k} * d.row + 1, 2))};
}
// Length of a step along it.
std::int64_t step_mm(const Direction& d, std::int32_t r_mm) {
  const std::int32_t squared = d.col * d.col + d.row * d.row;  // 4, 5 or 8
  return squared == 4 ? r_mm : std::int64_t{r_mm} * (squared == 5 ? 1118 : 1414) / 1000;
}

template <class Fn>
void for_each_square(const CellBox& box, const Fn& fn) {
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) fn(Cell{col, row});
}

// The profiles through a square, and sums over the shortest of them: those that cross most squarely.
struct Votes {
  std::int64_t length_mm = 0, ground_mm = 0;
  std::int32_t profiles = 0, shortest = 0, spread_mm = 0;

  void add(std::int64_t length, std::int64_t ground, std::int32_t spread) {
    ++profiles;
    if (shortest > 0 && length > length_mm) return;
    if (length < length_mm) shortest = 0, ground_mm = 0, spread_mm = 0;
    length_mm = length;
    ground_mm += ground;
    spread_mm = std::max(spread_mm, spread);
    ++shortest;
  }
  SpanGround mean() const {
    // Nobody saw it: the longer the profile, the less is known.
    return {static_cast<std::int32_t>(floor_div(2 * ground_mm + shortest, 2 * std::int64_t{shortest})),
            static_cast<std::uint16_t>(std::min<std::int64_t>(spread_mm / 2 + length_mm / 200, 65535))};
  }
};

class SpanFinder {
 public:
  SpanFinder(const std::vector<SquareHeights>& heights, const CellBox& interior, const SpanRules& rules)
      : heights_(heights),
        interior_(interior),
        voting_(interior.grown(2 * kRings)),
        held_(interior.grown(rules.halo())),
        rules_(rules),
        sure_(static_cast<std::size_t>(voting_.cells())),
        likely_(sure_.size()) {}

  std::vector<SpanGround> find() {
    const std::vector<Cell> feet = possible_feet();
    for (const Direction& d : kDirections) {
      step_mm_ = step_mm(d, rules_.r_mm);
      for (const Cell& foot : feet) profiles_from(foot, d);
    }
    return judged();
  }

 private:
  std::size_t vote_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - voting_.row0) * voting_.cols() + (c.col - voting_.col0));
  }
  bool is_sure(Cell c) const { return sure_[vote_index(c)].profiles >= kLeastProfiles; }

  std::vector<SpanGround> judged() const {
    std::vector<std::uint8_t> near(static_cast<std::size_t>(interior_.cells()), 0);  // a place that is surely a span
    for_each_square(interior_.grown(kRings), [&](Cell c) {
      std::int32_t sure = 0;
      for_each_square({c.col - kRings, c.row - kRings, c.col + kRings + 1, c.row + kRings + 1},
                      [&](Cell around) { sure += is_sure(around); });
      if (sure < kLeastSure) return;
      for_each_square(interior_.intersect({c.col - kRings, c.row - kRings, c.col + kRings + 1, c.row + kRings + 1}),
                      [&](Cell around) { near[interior_index(around)] = 1; });
    });
    std::vector<SpanGround> out(near.size());
    for_each_square(interior_, [&](Cell c) {
      if (!near[interior_index(c)]) return;
      const Votes& votes = is_sure(c) ? sure_[vote_index(c)] : likely_[vote_index(c)];
      if (votes.profiles > 0) out[interior_index(c)] = votes.mean();
    });
    return out;
  }
  std::size_t interior_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - interior_.row0) * interior_.cols() +
                                    (c.col - interior_.col0));
  }

  // nullptr outside, and where nothing is known.
  const SquareHeights* at(Cell c) const {
    if (!held_.contains(c)) return nullptr;
    const SquareHeights& h =
        heights_[static_cast<std::size_t>((std::int64_t{c.row} - held_.row0) * held_.cols() + (c.col - held_.col0))];
    return h.known() ? &h : nullptr;
  }
  // A drop within so many steps: a sure one is as high as the rules say and steeper than 3 in 4; near the ends of a
  // span, where the ground comes up to the deck, a third of both will do.
  bool sheer(std::int32_t low_mm, std::int32_t high_mm, std::int64_t steps, std::int32_t share = kLeastShare) const {
    const std::int64_t drop = share * (std::int64_t{high_mm} - low_mm);
    return drop >= rules_.drop_mm && 4 * drop >= 3 * steps * step_mm_;
  }
  // A deck leans and sags, but not by more than 1 in 8 (and the noise of a node).
  bool flat(std::int32_t a_mm, std::int32_t b_mm, std::int64_t steps) const {
    return 8 * std::abs(std::int64_t{a_mm} - b_mm) <= steps * step_mm_ + 1000;
  }
  // How far the ground rises beyond a foot, per step, in 1/6 mm; `away` is 1 or -1 along the direction.
  std::int64_t slope_beyond(Cell foot, std::int32_t foot_mm, const Direction& d, std::int32_t away) const {
    for (const std::int32_t k : {2, 3, 1})
      if (const SquareHeights* h = at(moved(foot, d, away * k))) return 6 * (std::int64_t{h->low_mm} - foot_mm) / k;
    return 0;
  }

  // Squares with something within reach that is high enough to be an edge, in whatever direction: few.
  std::vector<Cell> possible_feet() const {
    const auto reach = static_cast<std::int32_t>(rules_.reach_mm() / rules_.r_mm);
    const auto cols = static_cast<std::int32_t>(held_.cols()), rows = static_cast<std::int32_t>(held_.rows());
    std::vector<std::int32_t> along_row(heights_.size(), kUnknownHeight_mm), highest(along_row);
    for (std::int32_t row = 0; row < rows; ++row)
      for (std::int32_t k = -reach; k <= reach; ++k)
        for (std::int32_t col = std::max(0, -k); col < cols - std::max(0, k); ++col) {
          const std::ptrdiff_t at = std::ptrdiff_t{row} * cols + col;
          along_row[static_cast<std::size_t>(at)] =
              std::max(along_row[static_cast<std::size_t>(at)], heights_[static_cast<std::size_t>(at + k)].high_mm);
        }
    for (std::int32_t k = -reach; k <= reach; ++k)
      for (std::int32_t row = std::max(0, -k); row < rows - std::max(0, k); ++row)
        for (std::int32_t col = 0; col < cols; ++col) {
          const std::ptrdiff_t at = std::ptrdiff_t{row} * cols + col;
          highest[static_cast<std::size_t>(at)] =
              std::max(highest[static_cast<std::size_t>(at)],
                       along_row[static_cast<std::size_t>(at + std::ptrdiff_t{k} * cols)]);
        }
    std::vector<Cell> feet;
    std::size_t at = 0;
    for_each_square(held_, [&](Cell c) {
      const SquareHeights& h = heights_[at];
      if (h.known() && kLeastShare * (std::int64_t{highest[at]} - h.low_mm) >= rules_.drop_mm) feet.push_back(c);
      ++at;
    });
    return feet;
  }

  // All profiles whose first foot is here.
  void profiles_from(Cell foot, const Direction& d) {
    const SquareHeights* here = at(foot);
    if (!here) return;
    const std::int64_t reach = rules_.reach_mm() / step_mm_;
    for (std::int32_t k = 1; k <= reach; ++k) {
      const SquareHeights* edge = at(moved(foot, d, k));
      if (!edge || !sheer(here->low_mm, edge->high_mm, k)) continue;
      bool begun = false;  // the strip, nearer to the foot
      for (std::int32_t n = 1; n < k; ++n)
        if (const SquareHeights* h = at(moved(foot, d, n))) begun |= flat(h->high_mm, edge->high_mm, k - n);
      if (!begun) follow(foot, here->low_mm, d, k);
    }
  }

  // Along the strip that starts `first` steps from the foot, to every other foot.
  void follow(Cell foot, std::int32_t foot_mm, const Direction& d, std::int32_t first) {
    const std::int64_t reach = rules_.reach_mm() / step_mm_, width = rules_.width_mm / step_mm_;
    const std::int32_t first_mm = at(moved(foot, d, first))->high_mm;
    std::int32_t last = first, last_mm = first_mm, strip = 1;
    bool fallen = false;
    for (std::int32_t k = first + 1; k - last <= reach; ++k) {
      const SquareHeights* next = at(moved(foot, d, k));
      if (!next) continue;
      if (next->high_mm > last_mm || flat(next->high_mm, last_mm, k - last)) {
        if (fallen || !flat(next->high_mm, last_mm, k - last)) return;  // another wall
        if (k - first >= width) return;
        last = k;
        last_mm = next->high_mm;
        ++strip;
        continue;
      }
      fallen = true;
      if (strip < kLeastStrip || !sheer(next->low_mm, last_mm, k - last) ||
          !continues(foot, foot_mm, d, k, next->low_mm))
        continue;
      vote(foot, foot_mm, d, k, next->low_mm,
           sheer(foot_mm, first_mm, first, 1) && sheer(next->low_mm, last_mm, k - last, 1) &&
               !slopes(foot, d, 0, first, foot_mm, first_mm) && !slopes(foot, d, last, k, next->low_mm, last_mm));
    }
  }

  // Ground between a deck and its foot: the side of an embankment or a ridge.
  bool slopes(Cell foot, const Direction& d, std::int32_t from, std::int32_t to, std::int32_t low_mm,
              std::int32_t high_mm) const {
    const std::int32_t margin_mm = (high_mm - low_mm) / 4;
    for (std::int32_t k = from + 1; k < to; ++k)
      if (const SquareHeights* h = at(moved(foot, d, k)))
        if (h->low_mm > low_mm + margin_mm && h->high_mm < high_mm - margin_mm) return true;
    return false;
  }

  // The ground at one foot continues that at the other, as a road does that passes below. Between a street and the pit
  // beside it, it doesn't.
  bool continues(Cell foot, std::int32_t foot_mm, const Direction& d, std::int32_t steps, std::int32_t other_mm) const {
    const std::int64_t rise = slope_beyond(moved(foot, d, steps), other_mm, d, 1) - slope_beyond(foot, foot_mm, d, -1);
    const std::int64_t expected_mm = floor_div(rise * steps, 12);
    return 6 * std::abs(std::int64_t{other_mm} - foot_mm - expected_mm) <= rules_.drop_mm;
  }

  void vote(Cell foot, std::int32_t foot_mm, const Direction& d, std::int32_t steps, std::int32_t other_mm, bool sure) {
    const std::int64_t rise = std::int64_t{other_mm} - foot_mm;
    for (std::int32_t k = 1; k < steps; ++k) {
      const Cell c = moved(foot, d, k);
      if (!voting_.contains(c)) continue;
      const std::int64_t ground_mm = foot_mm + floor_div(2 * rise * k + steps, 2 * std::int64_t{steps});
      const auto spread_mm = static_cast<std::int32_t>(std::abs(rise));
      likely_[vote_index(c)].add(steps * step_mm_, ground_mm, spread_mm);
      if (sure) sure_[vote_index(c)].add(steps * step_mm_, ground_mm, spread_mm);
    }
  }

  const std::vector<SquareHeights>& heights_;
  CellBox interior_, voting_, held_;
  SpanRules rules_;
  std::int64_t step_mm_ = 0;
  std::vector<Votes> sure_, likely_;  // per square of voting_
};

}  // namespace

SpanRules::SpanRules(const LevelParameters& p, std::int32_t r)
    : r_mm(r),
      width_mm(static_cast<std::int32_t>(std::min(std::floor(p.span_width_m * 1000 + 0.5), 64.0 * r))),
      drop_mm(static_cast<std::int32_t>(std::floor(p.span_drop_m * 1000 + 0.5))) {}

std::int32_t SpanRules::halo() const {
  // A profile reaches over the strip and both drops, and looks three squares beyond either foot.
  return static_cast<std::int32_t>(ceil_div(std::int64_t{width_mm} + 2 * reach_mm(), r_mm)) + 3 + 2 * kRings;
}

SquareHeights square_heights(std::span<const std::int32_t> nodes_mm, const SpanRules& rules) {
  std::int32_t lowest = INT32_MAX;
  SquareHeights out;
  for (const std::int32_t z : nodes_mm) {
    if (z == kUnknownHeight_mm) continue;
    lowest = std::min(lowest, z);
    out.high_mm = std::max(out.high_mm, z);
  }
  if (lowest == INT32_MAX) return out;
  std::int64_t sum = 0, n = 0;
  for (const std::int32_t z : nodes_mm)
    if (z != kUnknownHeight_mm && 3 * (std::int64_t{z} - lowest) <= rules.drop_mm) sum += z, ++n;
  out.low_mm = static_cast<std::int32_t>(floor_div(2 * sum + n, 2 * n));
  return out;
}

std::vector<SpanGround> find_spans(const std::vector<SquareHeights>& heights, const CellBox& interior,
                                   const SpanRules& rules) {
  return SpanFinder(heights, interior, rules).find();
}

}  // namespace btms
