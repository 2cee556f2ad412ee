// The command line as `btms man` and `btms completion` describe it: what CLI11 was told, and nothing else.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace btms {

// What --help lists, in its order.
std::vector<const CLI::App*> shown_subcommands(const CLI::App& btms);
// Options with a name (`positional` false) or without.
std::vector<const CLI::Option*> shown_options(const CLI::App& app, bool positional);
// "-o", "--output".
std::vector<std::string> flags_of(const CLI::Option& option);
// The values it takes where they are few: "auto", "bar", ...
std::vector<std::string> values_of(const CLI::Option& option);
// "FILE" or "STYLE"; empty for flags.
std::string placeholder_of(const CLI::Option& option);

}  // namespace btms
