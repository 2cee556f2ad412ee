// The handlers, a file a group.
#pragma once

#include <array>
#include <nlohmann/json.hpp>

#include "apps/server/problem.h"
#include "apps/server/service.h"
#include "io/export/raster.h"

namespace btms {

using Json = nlohmann::json;

// What handlers share.
Response json_response(const Json& json);
// Four numbers separated by commas, the lower corner before the upper one. Throws Problem("bad_parameter").
std::array<double, 4> box_of(const std::string& text, const char* field);
// A number of the query. Throws Problem("bad_parameter").
double number_parameter(const Call& call, const char* name);
std::optional<double> optional_number(const Call& call, const char* name);
std::string parameter(const Call& call, const char* name, const char* otherwise);
// The body as JSON, not nested deeply. Throws Problem("bad_body").
Json json_body(const Call& call);
// [x, y] of finite numbers. Throws Problem("bad_body") naming the field.
Place place_member(const Json& value, const char* field);
const Json& array_member_of(const Json& object, const char* field);
std::string text_member(const Json& object, const char* field, const char* otherwise);
// Names separated by commas, all known, none twice; elevation when there are none.
std::vector<const RasterLayer*> layers_of(const std::string& names);
// "layers" of a body, an array of them; as above.
std::vector<const RasterLayer*> layers_member(const Json& object);
std::string names_of(const std::vector<const RasterLayer*>& layers);

// maps.cpp
Response list_maps(const Call& call);
Response describe_map(const Call& call);
Response list_tiles(const Call& call);
// tiles.cpp
Response get_tile(const Call& call);
std::optional<Response> get_tile_at_once(const Call& call);
Response post_bundle(const Call& call);
// diff.cpp
Response post_diff(const Call& call);
// heights.cpp
Response get_height(const Call& call);
Response post_heights(const Call& call);
// windows.cpp
Response get_submap(const Call& call);
Response get_costmap(const Call& call);
Response get_costmap_yaml(const Call& call);
// checks.cpp
Response post_profile(const Call& call);
Response post_check(const Call& call);
Response post_route(const Call& call);
// event_answers.cpp
Response get_events(const Call& call);
// edr.cpp
Response list_collections(const Call& call);
Response describe_collection(const Call& call);
Response get_position(const Call& call);
Response get_trajectory(const Call& call);
Response get_area(const Call& call);
Response get_cube(const Call& call);
// xyz.cpp
Response get_tilejson(const Call& call);
Response get_web_tile(const Call& call);
// openapi.cpp
Response get_openapi(const Call& call);
// service_answers.cpp
Response get_health(const Call& call);
Response get_ready(const Call& call);
Response get_metrics(const Call& call);
Response get_file(const Call& call);

}  // namespace btms
