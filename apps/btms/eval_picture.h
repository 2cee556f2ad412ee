// The picture of `btms eval`: where the wrong points are.
#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "apps/btms/eval_files.h"
#include "io/export/verdict_picture.h"

namespace btms {

// One picture of all pairs, read one after the other; `box` crops it. Precondition: every pair has `points`. Throws
// Error(kBadInput) as verdicts() does and where there is nothing to draw, Error(kCancelled), Error(kFailed).
void write_eval_picture(std::span<const EvalPair> pairs, const TruthRules& rules, const std::optional<PlanBox>& box,
                        const std::filesystem::path& png);

}  // namespace btms
