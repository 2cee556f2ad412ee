#include "apps/server/problem.h"

#include <nlohmann/json.hpp>

#include <cstring>

namespace btms {
namespace {

struct Kind {
  const char* code;
  int status;
  const char* title;
};

constexpr Kind kKinds[] = {
    {"bad_request", 400, "The request is malformed"},
    {"bad_target", 400, "The target is malformed"},
    {"bad_parameter", 400, "A parameter is missing or out of range"},
    {"bad_body", 400, "The body is malformed"},
    {"token", 401, "A token is needed"},
    {"not_found", 404, "There is nothing here"},
    {"unknown_map", 404, "There is no such map"},
    {"unknown_level", 404, "The map has no such level"},
    {"no_crs", 404, "The map can't be placed on the Earth"},
    {"outside", 404, "The map is not there"},
    {"method", 405, "The method does not fit"},
    {"not_acceptable", 406, "There is no such form"},
    {"slow_request", 408, "The request took too long to arrive"},
    {"body_too_large", 413, "The body is too large"},
    {"too_much", 413, "More is asked for than one request may ask for"},
    {"target_too_long", 414, "The target is too long"},
    {"range", 416, "The range can't be served"},
    {"too_many", 429, "Too many connections from one address"},
    {"header_too_large", 431, "The header is too large"},
    {"failed", 500, "The request failed"},
    {"tile_corrupt", 500, "A tile of the map is damaged"},
    {"busy", 503, "The server is busy"},
    {"takes_long", 503, "The answer takes longer than one request may"},
};

const Kind& kind_of(const char* code) {
  for (const Kind& kind : kKinds)
    if (std::strcmp(kind.code, code) == 0) return kind;
  return kind_of("failed");
}

}  // namespace

int Problem::status() const { return kind_of(code_).status; }

Response Problem::response() const {
  const Kind& kind = kind_of(code_);
  nlohmann::json json{{"code", kind.code}, {"title", kind.title}, {"status", kind.status}};
  if (!detail_.empty()) json["detail"] = detail_;
  if (!field_.empty()) json["field"] = field_;
  if (!allowed_.empty()) json["allowed"] = allowed_;
  Response response;
  response.status = kind.status;
  response.content_type = "application/problem+json";
  response.body = body_of(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  if (kind.status == 503 || kind.status == 429) response.set("Retry-After", "1");
  if (kind.status == 401) response.set("WWW-Authenticate", "Bearer");
  if (kind.status == 405) {
    std::string allow;
    for (const std::string& method : allowed_) allow += (allow.empty() ? "" : ", ") + method;
    response.set("Allow", allow);
  }
  return response;
}

}  // namespace btms
