#include "apps/btms/eval_picture.h"

#include <algorithm>

#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "io/points/point_file.h"

namespace btms {
namespace {

void for_each_verdict(const EvalPair& pair, const TruthRules& rules, auto&& fn) {
  throw_if_stopped();
  const std::vector<Verdict> all = verdicts(pair, rules);
  PointBlock block;
  open_points(pair.points)->read(0, all.size(), block);
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i] != Verdict::kLeftOut && block.x_mm[i] != PointBlock::kDroppedX) fn(block.x_mm[i], block.y_mm[i], all[i]);
}

}  // namespace

void write_eval_picture(std::span<const EvalPair> pairs, const TruthRules& rules, const std::optional<PlanBox>& box,
                        const std::filesystem::path& png) {
  // Files are read twice: what fits the memory one by one need not fit it as a whole.
  PlanBox hull;
  std::uint64_t points = 0;
  for (const EvalPair& pair : pairs)
    for_each_verdict(pair, rules, [&](std::int64_t x_mm, std::int64_t y_mm, Verdict) {
      if (box && !box->contains(x_mm, y_mm)) return;
      if (points++ == 0) hull = {x_mm, y_mm, x_mm + 1, y_mm + 1};
      hull = {std::min(hull.x0_mm, x_mm), std::min(hull.y0_mm, y_mm), std::max(hull.x1_mm, x_mm + 1),
              std::max(hull.y1_mm, y_mm + 1)};
    });
  if (points == 0) throw Error(ErrorCode::kBadInput, "--picture: no point that counts lies in it", png.string());
  VerdictPicture picture(box.value_or(hull), points);
  for (const EvalPair& pair : pairs)
    for_each_verdict(pair, rules,
                     [&](std::int64_t x_mm, std::int64_t y_mm, Verdict v) { picture.draw(x_mm, y_mm, v); });
  picture.write_png(png);
}

}  // namespace btms
