// The tables and the JSON of `btms eval`.
#pragma once

#include <vector>

#include "apps/btms/eval_files.h"
#include "engine/metrics/metrics.h"

namespace btms {

void print_eval_text(const std::vector<EvalResult>& results, const TruthRules& rules, bool per_class);
void print_eval_json(const std::vector<EvalResult>& results, const TruthRules& rules);

}  // namespace btms
