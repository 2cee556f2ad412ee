// Ranges of real numbers on the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace btms {

// As CLI::Range, which lets "nan" through.
CLI::Validator number_range(double low, double high);

}  // namespace btms
