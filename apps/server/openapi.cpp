// /openapi.json: OpenAPI 3.0 from the table of endpoints, so that it cannot be out of date.
#include <cctype>
#include <sstream>

#include "apps/server/handlers.h"

namespace btms {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> words;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, separator);) words.push_back(word);
  return words;
}

Json schema_of(const std::string& type) {
  if (type.find('|') != type.npos) return {{"type", "string"}, {"enum", split(type, '|')}};
  return {{"type", type}};
}

Json parameter_json(const char* name, const char* in, const Json& schema, const std::string& about, bool required) {
  Json json{{"name", name}, {"in", in}, {"required", required}, {"schema", schema}};
  if (!about.empty()) json["description"] = about;
  return json;
}

// Names what {} stands for, and lists it.
std::string named(std::string path, Json& parameters) {
  const auto next = [&](const std::string& from, const char* name, const char* type) {
    const std::size_t at = path.find(from);
    if (at == path.npos) return;
    path.replace(at, from.size(), std::string("{") + name + "}");
    parameters.push_back(parameter_json(name, "path", {{"type", type}}, "", true));
  };
  next("{m}", "map", "string");
  for (const char* name : {"level", "column", "row"}) next("{}", name, "integer");
  return path;
}

Json operation(const Endpoint& endpoint, Json parameters) {
  for (const Parameter& p : endpoint.parameters)
    parameters.push_back(parameter_json(p.name, "query", schema_of(p.type), p.about, p.required));
  Json content = Json::object();
  for (const std::string& type : split(endpoint.produces, ' ')) content[type] = Json::object();
  const Json problem{{"description", "A problem: code, title, detail, and the field at fault"},
                     {"content", {{"application/problem+json", Json::object()}}}};
  Json json{{"summary", endpoint.summary},
            {"parameters", std::move(parameters)},
            {"responses", {{"200", {{"description", "The answer"}, {"content", content}}}, {"default", problem}}}};
  if (endpoint.body)
    json["requestBody"] = {{"required", true},
                           {"content", {{"application/json", {{"example", Json::parse(endpoint.body)}}}}}};
  return json;
}

}  // namespace

Response get_openapi(const Call&) {
  Json paths = Json::object();
  for (const Endpoint& endpoint : endpoints()) {
    if (std::string(endpoint.pattern) == "/{*}") continue;
    Json parameters = Json::array();
    const std::string path = named(endpoint.pattern, parameters);
    std::string method = endpoint.method;
    for (char& c : method) c = static_cast<char>(std::tolower(c));
    paths[path][method] = operation(endpoint, std::move(parameters));
  }
  return json_response({{"openapi", "3.0.3"},
                        {"info", {{"title", "B-TMS Engine tile service"}, {"version", "1"}}},
                        {"paths", std::move(paths)}});
}

}  // namespace btms
