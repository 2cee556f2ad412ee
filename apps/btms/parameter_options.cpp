#include "apps/btms/parameter_options.h"

#include <spdlog/fmt/fmt.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "engine/error.h"
#include "io/files/read_file.h"

namespace btms {
namespace {

std::string help_text(const ParameterInfo& info, const Parameters& defaults) {
  std::string text(info.help);
  if (!info.symbol.empty()) text += fmt::format(" ({})", info.symbol);
  return text + fmt::format("; {}, default {}", range_text(info), parameter_text(defaults, info));
}

// Parameters and `preset` as top-level keys. Applies the preset first, wherever it stands, unless a flag chose one.
void apply_config(const std::string& file, ParameterChoice& choice, bool preset_is_given) {
  const auto refuse = [&](const YAML::Mark& mark, const std::string& message) {
    const std::string where = mark.is_null() ? file : fmt::format("{}: line {}", file, mark.line + 1);
    throw Error(ErrorCode::kUsage, message, where);
  };
  try {
    constexpr std::uint64_t kMost_bytes = 1 << 20;
    const std::vector<std::uint8_t> text = read_file(file, kMost_bytes, ErrorCode::kUsage);
    const YAML::Node root = YAML::Load(std::string(text.begin(), text.end()));
    if (root.IsNull()) return;
    if (!root.IsMap()) refuse(root.Mark(), "expected a list of `parameter: value`");
    if (const YAML::Node name = root["preset"]; name && !preset_is_given)
      choice = {preset(name.as<std::string>()), name.as<std::string>()};
    for (const auto& entry : root) {
      const auto key = entry.first.as<std::string>();
      if (key == "preset") continue;
      if (!entry.second.IsScalar()) refuse(entry.second.Mark(), fmt::format("`{}` needs a single value", key));
      try {
        set_parameter(choice.parameters, key, entry.second.Scalar());
      } catch (const Error& e) {
        refuse(entry.first.Mark(), e.what());
      }
    }
  } catch (const YAML::Exception& e) {
    refuse(e.mark, e.msg);
  }
}

}  // namespace

void ParameterOptions::add_to(CLI::App& app, std::string_view default_preset) {
  const char* group = "Parameters (preset, then config file, then flags)";
  preset_ = default_preset;
  preset_option_ =
      app.add_option("--preset", preset_, "Values to start from: " + preset_list())->type_name("NAME")->group(group);
  app.add_option("--config", config_, "YAML file with `parameter_name: value` lines, and `preset: NAME` if wanted")
      ->type_name("FILE")
      ->group(group);
  const Parameters defaults = preset(default_preset);
  for (const ParameterInfo& info : parameter_table()) {
    std::string names = flag_of(info.name);
    if (info.name == "resolution_m") names += ",--resolution";
    auto* option = app.add_option_function<std::string>(
        names, [](const std::string&) {}, help_text(info, defaults));
    option->type_name(info.unit.empty() ? "VALUE" : std::string(info.unit))->group(group);
    flags_.emplace_back(info.name, option);
  }
}

ParameterChoice ParameterOptions::resolve() const {
  ParameterChoice choice{preset(preset_), preset_};
  if (!config_.empty()) apply_config(config_, choice, preset_option_->count() > 0);
  for (const auto& [name, option] : flags_)
    if (option->count() > 0) set_parameter(choice.parameters, name, option->results().back());
  check(choice.parameters);
  return choice;
}

bool ParameterOptions::given() const {
  return preset_option_->count() > 0 || !config_.empty() ||
         std::any_of(flags_.begin(), flags_.end(), [](const auto& flag) { return flag.second->count() > 0; });
}

std::string flag_of(std::string_view parameter_name) {
  std::string flag = "--" + std::string(parameter_name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string range_text(const ParameterInfo& info) {
  if (info.choices.empty()) return fmt::format("{} to {}", info.min, info.max);
  std::string text(info.choices);
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos;) text.replace(at, 1, " or ");
  return text;
}

Json parameter_json(const Parameters& parameters, const ParameterInfo& info) {
  if (const auto* field = std::get_if<double Parameters::*>(&info.field)) return parameters.*(*field);
  if (const auto* field = std::get_if<int Parameters::*>(&info.field)) return parameters.*(*field);
  return parameter_text(parameters, info);
}

Json parameters_json(const Parameters& parameters) {
  Json all = Json::object();
  for (const ParameterInfo& info : parameter_table()) all[std::string(info.name)] = parameter_json(parameters, info);
  return all;
}

std::string preset_list() {
  std::string text;
  for (const std::string& name : preset_names()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace btms
