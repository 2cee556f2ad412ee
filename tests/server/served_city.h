// A small city that is served, for tests of the service.
#pragma once

#include <memory>
#include <string>

#include "apps/server/service.h"
#include "tests/cli/program.h"

namespace btms::test {

class ServedCity : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--points", "300000", "-o", *folder_ / "truth"});
    run_json(
        {"build", *folder_ / "truth", "-o", map_path(), "--tile-cells", "2", "--crs", "EPSG:32632", "--updatable"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string map_path() { return *folder_ / "city.btms"; }
  static const TempFolder& folder() { return *folder_; }

  static ServiceOptions options() {
    ServiceOptions options;
    options.maps = {map_path()};
    return options;
  }
  static Request get(const std::string& target) { return request("GET", target); }
  static Request post(const std::string& target, std::string body) {
    Request r = request("POST", target);
    r.body = std::move(body);
    return r;
  }
  static Request request(const std::string& method, const std::string& target) {
    Request r;
    r.method = method;
    parse_target(target, r);
    return r;
  }
  static std::string text(const Response& response) {
    return response.body ? std::string(response.body->begin(), response.body->end()) : std::string();
  }
  static nlohmann::json json(const Response& response) { return nlohmann::json::parse(text(response), nullptr, false); }
  static std::string header(const Response& response, const std::string& name) {
    for (const auto& [key, value] : response.headers)
      if (key == name) return value;
    return "";
  }

 private:
  static inline std::unique_ptr<TempFolder> folder_;
};

// The city and a service of it, for a whole suite.
class AnsweredCity : public ServedCity {
 protected:
  static void SetUpTestSuite() {
    ServedCity::SetUpTestSuite();
    service_ = std::make_unique<Service>(options());
  }
  static void TearDownTestSuite() {
    service_.reset();
    ServedCity::TearDownTestSuite();
  }
  static Response ask(const Request& request) { return service_->answer(request); }
  static Response ask(const std::string& target) { return ask(get(target)); }
  static Response ask(const char* target) { return ask(std::string(target)); }
  static std::string code_of(const Response& response) { return json(response).value("code", ""); }
  static Service& service() { return *service_; }

 private:
  static inline std::unique_ptr<Service> service_;
};

}  // namespace btms::test
