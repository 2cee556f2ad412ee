// The plot of `btms sweep`, after the paper's Fig. 4: accuracy over each parameter, a panel each, as SVG.
#pragma once

#include <filesystem>

#include "apps/btms/sweep_report.h"

namespace btms {

// Throws Error(kFailed).
void write_sweep_plot(const Sweep& sweep, const std::filesystem::path& svg);

}  // namespace btms
