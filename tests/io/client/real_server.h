// The tile server in the test's own process.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "apps/server/http_server.h"
#include "io/client/http_client.h"

namespace btms::test {

class RealServer {
 public:
  explicit RealServer(const std::string& map, std::uint16_t port = 0)
      : service_({.maps = {map}, .viewer = {}, .token = {}, .limits = {}}), http_(service_, {"127.0.0.1", port, 2}) {
    thread_ = std::thread([this] { http_.run([](const std::string& wrong) { ADD_FAILURE() << wrong; }); });
  }
  ~RealServer() {
    http_.stop();
    thread_.join();
  }
  std::uint16_t port() const { return http_.port(); }
  ClientOptions options() const {
    ClientOptions options;
    options.url = "http://127.0.0.1:" + std::to_string(port());
    return options;
  }

 private:
  Service service_;
  HttpServer http_;
  std::thread thread_;
};

}  // namespace btms::test
