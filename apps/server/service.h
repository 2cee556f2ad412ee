// The API without sockets: a request in, an answer out. docs/http_api.md
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/server/body_cache.h"
#include "apps/server/limits.h"
#include "apps/server/message.h"
#include "apps/server/metrics.h"
#include "apps/server/served_map.h"
#include "apps/server/static_files.h"

namespace btms {

struct ServiceOptions {
  std::vector<std::filesystem::path> maps;
  std::filesystem::path viewer;                      // folder of the built viewer, or empty
  std::string token;                                 // asked of everybody, or empty
  std::size_t cache_bytes = std::size_t{512} << 20;  // decoded tiles of every map, and encoded answers, half each
  ServerLimits limits;
};

class Service;

// What a handler works on.
struct Call {
  const Request& request;
  const Service& service;
  std::vector<std::string> arguments;  // what {} in the route's pattern stands for, the map excluded
  std::string map_id;
  const ServedMap* map = nullptr;               // of routes below /v1/maps/{m}
  std::shared_ptr<const MapRevision> revision;  // of it: one for the whole request
  const ServerLimits& limits() const;
};

// One of the query, as openapi.json tells of it.
struct Parameter {
  const char* name;
  const char* type;  // "number", "integer", "string", or the words it may be: "raw|npy"
  const char* about;
  bool required = false;
};

struct Endpoint {
  const char* method;   // GET serves HEAD, too
  const char* pattern;  // segments; {m} is a map, {} anything, {*} the rest
  const char* summary;
  const char* produces;  // content types, separated by spaces
  std::span<const Parameter> parameters;
  const char* body;  // an example of what is posted, as JSON; nullptr of GET
  Response (*handle)(const Call& call);
  // May be asked first, on the thread that reads requests: an answer that takes no time, or nothing.
  std::optional<Response> (*at_once)(const Call& call);
};

// Thread-safe.
class Service {
 public:
  // Throws what opening the maps throws; Error(kUsage) when two have the same id.
  explicit Service(ServiceOptions options);

  // Never throws. `at_once`: only what takes no time; nothing means: ask again elsewhere.
  Response answer(const Request& request) const;
  std::optional<Response> answer_at_once(const Request& request) const;

  // Looks for new revisions; returns what was wrong with one, a line a map. One thread at a time.
  std::vector<std::string> refresh();

  const ServiceOptions& options() const { return options_; }
  const std::vector<std::unique_ptr<ServedMap>>& maps() const { return maps_; }
  BodyCache& bodies() const { return bodies_; }
  Metrics& metrics() const { return metrics_; }
  const StaticFiles& files() const { return files_; }

 private:
  std::optional<Response> dispatch(const Request& request, bool at_once) const;
  const ServiceOptions options_;
  std::vector<std::unique_ptr<ServedMap>> maps_;
  StaticFiles files_;
  mutable BodyCache bodies_;
  mutable Metrics metrics_;
};

std::span<const Endpoint> endpoints();

}  // namespace btms
