// btms params: every parameter with symbol, unit, range, default and source.
#include <spdlog/fmt/fmt.h>

#include "apps/btms/command.h"
#include "apps/btms/parameter_options.h"

namespace btms {
namespace {

struct ParamsCommand {
  CommonOptions common;
  std::string preset = "city";
  bool schema = false;
  bool markdown = false;
};

Json schema_json(const Parameters& defaults) {
  Json properties;
  properties["preset"] = {{"type", "string"}, {"enum", preset_names()}};
  for (const ParameterInfo& info : parameter_table()) {
    Json property;
    if (!info.choices.empty()) {
      property["type"] = "string";
      Json choices = Json::array();
      std::string_view left = info.choices;
      while (true) {
        const std::size_t bar = left.find('|');
        choices.push_back(left.substr(0, bar));
        if (bar == std::string_view::npos) break;
        left.remove_prefix(bar + 1);
      }
      property["enum"] = choices;
    } else {
      property["type"] = std::holds_alternative<int Parameters::*>(info.field) ? "integer" : "number";
      property["minimum"] = info.min;
      property["maximum"] = info.max;
    }
    property["default"] = parameter_json(defaults, info);
    property["description"] = info.help;
    if (!info.unit.empty()) property["unit"] = info.unit;
    properties[std::string(info.name)] = property;
  }
  Json schema;
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  schema["title"] = "Configuration of btms build and btms segment (--config)";
  schema["type"] = "object";
  schema["additionalProperties"] = false;
  schema["properties"] = properties;
  return schema;
}

Json table_json(const std::string& name, const Parameters& values) {
  Json rows = Json::array();
  for (const ParameterInfo& info : parameter_table()) {
    Json row{{"name", info.name}, {"flag", flag_of(info.name)}, {"symbol", info.symbol}, {"unit", info.unit}};
    if (info.choices.empty()) {
      row["min"] = info.min;
      row["max"] = info.max;
    } else {
      row["choices"] = info.choices;
    }
    row["default"] = parameter_json(values, info);
    row["source"] = info.source;
    row["help"] = info.help;
    rows.push_back(row);
  }
  Json json{{"preset", name}};
  json["parameters"] = rows;
  return json;
}

void print_row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  print_line(line);
}

// docs/parameters.md, where a test compares it.
void print_page() {
  print_line(
      "# Parameters\n\n"
      "Written by `btms params --markdown`, from the table that flags, `--config` files and maps are made of. Names "
      "are keys "
      "of a YAML file\n"
      "([config.yaml](config.yaml) is an example, [config.schema.json](config.schema.json) its schema); "
      "`slope_max_deg` is "
      "the flag\n"
      "`--slope-max-deg`. A preset counts least, a file more, a flag most. Defaults are those of the preset `city`.\n");
  const Parameters city = preset("city");
  print_row({"name", "symbol", "unit", "range", "default", "what it does", "source"});
  print_line("|---|---|---|---|---|---|---|");
  for (const ParameterInfo& info : parameter_table())
    print_row({fmt::format("`{}`", info.name), std::string(info.symbol), std::string(info.unit), range_text(info),
               parameter_text(city, info), std::string(info.help), std::string(info.source)});
  print_line("\n## What the presets change\n\nEmpty where the value is that of `city`.\n");
  std::vector<std::string> head{"name"}, rule{"---"};
  for (const std::string& name : preset_names()) {
    head.push_back(fmt::format("`{}`", name));
    rule.emplace_back("---");
  }
  print_row(head);
  print_row(rule);
  for (const ParameterInfo& info : parameter_table()) {
    std::vector<std::string> row{fmt::format("`{}`", info.name)};
    const std::string usual = parameter_text(city, info);
    bool differs = false;
    for (const std::string& name : preset_names()) {
      const std::string value = parameter_text(preset(name), info);
      differs = differs || value != usual;
      row.push_back(value != usual || name == "city" ? value : "");
    }
    if (differs) print_row(row);
  }
}

int run_params(const ParamsCommand& command) {
  const Parameters values = preset(command.preset);
  if (command.markdown) {
    print_page();
  } else if (command.schema) {
    print_json(schema_json(values));
  } else if (command.common.json) {
    print_json(table_json(command.preset, values));
  } else {
    TextTable table(TextTable::Align::kLeft);
    table.row({"parameter", "symbol", "unit", "range", command.preset, "source", "what it does"});
    for (const ParameterInfo& info : parameter_table())
      table.row({std::string(info.name), std::string(info.symbol), std::string(info.unit), range_text(info),
                 parameter_text(values, info), std::string(info.source), std::string(info.help)});
    table.print();
  }
  return 0;
}

constexpr const char* kParamsFooter =
    "Examples:\n"
    "  btms params --preset single-scan\n"
    "  btms params --schema > config.schema.json      # first line of a file:  # yaml-language-server: "
    "$schema=config.schema.json\n"
    "\n"
    "A parameter `name_like_this` is the flag --name-like-this of build and segment, and the key name_like_this of a\n"
    "--config file. A preset counts least, a config file more, a flag most.";

}  // namespace

Command add_params(CLI::App& btms) {
  auto command = std::make_shared<ParamsCommand>();
  CLI::App* app = btms.add_subcommand("params", "List the method's parameters, their ranges, defaults and sources");
  app->footer(kParamsFooter);
  app->add_option("--preset", command->preset, "Whose values to show: " + preset_list())->type_name("NAME");
  app->add_flag("--schema", command->schema, "Print a JSON schema of the configuration file instead");
  app->add_flag("--markdown", command->markdown,
                "Print all presets as a page in Markdown (docs/parameters.md) instead");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_params(*command); }};
}

}  // namespace btms
