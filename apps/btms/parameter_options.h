// The method's parameters as options: a preset, then a YAML file, then one flag per row of the parameter table.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/btms/report.h"
#include "engine/terrain/parameters.h"

namespace btms {

struct ParameterChoice {
  Parameters parameters;
  std::string preset;  // the name they started from
};

// The options of one subcommand. Must outlive the parsing of the command line.
class ParameterOptions {
 public:
  void add_to(CLI::App& app, std::string_view default_preset);
  // Throws Error(kUsage) naming the flag, or the file and line, and the range.
  ParameterChoice resolve() const;
  // Whether the command line says anything about them.
  bool given() const;

 private:
  std::string preset_, config_;
  CLI::Option* preset_option_ = nullptr;
  std::vector<std::pair<std::string, CLI::Option*>> flags_;  // table name, option
};

// "--slope-max-deg" for "slope_max_deg".
std::string flag_of(std::string_view parameter_name);
// "0.1 to 65.534" or "pca or robust".
std::string range_text(const ParameterInfo& info);
// Every parameter by name, numbers as numbers.
Json parameters_json(const Parameters& parameters);
Json parameter_json(const Parameters& parameters, const ParameterInfo& info);
// The presets' names, separated by commas.
std::string preset_list();

}  // namespace btms
