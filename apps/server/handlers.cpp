#include "apps/server/handlers.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "io/export/raster.h"

namespace btms {
namespace {

constexpr int kMaxDepth = 8;

// The parser's memory and time are bounded by the body's length; depth is what could still hurt.
bool too_deep(const std::string& text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxDepth) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

}  // namespace

Response json_response(const Json& json) {
  Response response;
  response.content_type = "application/json";
  response.body = body_of(json.dump(-1, ' ', false, Json::error_handler_t::replace));
  return response;
}

std::array<double, 4> box_of(const std::string& text, const char* field) {
  const auto bad = [&] { return Problem("bad_parameter", "expected min x, min y, max x, max y", field); };
  std::array<double, 4> box{};
  const char *at = text.data(), *end = text.data() + text.size();
  for (std::size_t i = 0; i < box.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) throw bad();
    const auto [next, error] = std::from_chars(at, end, box[i]);
    if (error != std::errc() || !std::isfinite(box[i])) throw bad();
    at = next;
  }
  if (at != end || box[0] > box[2] || box[1] > box[3]) throw bad();
  return box;
}

std::optional<double> optional_number(const Call& call, const char* name) {
  const auto it = call.request.query.find(name);
  if (it == call.request.query.end()) return {};
  const std::string& text = it->second;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw Problem("bad_parameter", "expected a number", name);
  return value;
}

double number_parameter(const Call& call, const char* name) {
  const auto value = optional_number(call, name);
  if (!value) throw Problem("bad_parameter", "it is missing", name);
  return *value;
}

std::string parameter(const Call& call, const char* name, const char* otherwise) {
  const auto it = call.request.query.find(name);
  return it == call.request.query.end() ? otherwise : it->second;
}

Json json_body(const Call& call) {
  if (too_deep(call.request.body)) throw Problem("bad_body", "nested too deeply");
  Json json = Json::parse(call.request.body, nullptr, false);
  if (!json.is_object()) throw Problem("bad_body", "expected a JSON object");
  return json;
}

Place place_member(const Json& value, const char* field) {
  if (!value.is_array() || value.size() < 2 || !value[0].is_number() || !value[1].is_number())
    throw Problem("bad_body", "expected [x, y]", field);
  const Place place{value[0].get<double>(), value[1].get<double>()};
  if (!std::isfinite(place.x_m) || !std::isfinite(place.y_m)) throw Problem("bad_body", "not a finite number", field);
  return place;
}

const Json& array_member_of(const Json& object, const char* field) {
  const auto it = object.find(field);
  if (it == object.end() || !it->is_array()) throw Problem("bad_body", "expected an array", field);
  return *it;
}

std::vector<const RasterLayer*> layers_of(const std::string& names) {
  std::vector<const RasterLayer*> out;
  for (std::size_t at = 0; at <= names.size();) {
    const std::size_t end = std::min(names.find(',', at), names.size());
    const RasterLayer* layer = find_raster_layer(std::string_view(names).substr(at, end - at));
    if (!layer || std::find(out.begin(), out.end(), layer) != out.end()) {
      std::vector<std::string> allowed;
      for (const RasterLayer& known : raster_layers()) allowed.emplace_back(known.name);
      throw Problem("bad_parameter", "expected names of layers, each once, separated by commas", "layers", allowed);
    }
    out.push_back(layer);
    at = end + 1;
  }
  return out;
}

std::string text_member(const Json& object, const char* field, const char* otherwise) {
  const auto it = object.find(field);
  if (it == object.end()) return otherwise;
  if (!it->is_string()) throw Problem("bad_body", "expected a text", field);
  return it->get<std::string>();
}

std::vector<const RasterLayer*> layers_member(const Json& object) {
  if (!object.contains("layers")) return layers_of("elevation");
  std::string names;
  for (const Json& name : array_member_of(object, "layers")) {
    if (!name.is_string()) throw Problem("bad_body", "expected names", "layers");
    names.append(names.empty() ? "" : ",").append(name.get<std::string>());
  }
  return layers_of(names);
}

std::string names_of(const std::vector<const RasterLayer*>& layers) {
  std::string names;
  for (const RasterLayer* layer : layers) names.append(names.empty() ? "" : ",").append(layer->name);
  return names;
}

}  // namespace btms
