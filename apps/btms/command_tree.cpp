#include "apps/btms/command_tree.h"

#include "engine/terrain/parameters.h"

namespace btms {

std::vector<const CLI::App*> shown_subcommands(const CLI::App& btms) {
  return btms.get_subcommands([](const CLI::App* app) { return !app->get_group().empty(); });
}

std::vector<const CLI::Option*> shown_options(const CLI::App& app, bool positional) {
  return app.get_options([&](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

std::vector<std::string> flags_of(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_snames()) flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) flags.push_back("--" + name);
  return flags;
}

std::vector<std::string> values_of(const CLI::Option& option) {
  if (option.check_lname("preset")) return preset_names();
  const std::string type = option.get_type_name();  // "STYLE:{auto,bar}"
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

std::string placeholder_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return option.get_items_expected_max() == 0 ? std::string() : type.substr(0, type.find(':'));
}

}  // namespace btms
