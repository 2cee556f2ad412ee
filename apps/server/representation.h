// Which form of an answer is sent (RFC 9110): compressed where the client takes gzip and it pays, or a range of bytes.
#pragma once

#include <optional>
#include <string>

#include "apps/server/body_cache.h"

namespace btms {

// The validator a client holds of what `etag` names, as it is or compressed; nothing when If-None-Match names neither.
// `etag` with its quotes.
std::optional<std::string> held_validator(const Request& request, const std::string& etag);

// Makes of a whole answer what is sent. `scope` keeps the validators of one endpoint and map apart in
// the cache. With `at_once` only what takes no time: false means that it would have taken some, and nothing was done.
bool represent(const Request& request, const std::string& scope, BodyCache& bodies, bool at_once, Response& response);

}  // namespace btms
