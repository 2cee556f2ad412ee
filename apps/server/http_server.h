// The service behind a socket: HTTP/1.1, asynchronous on few threads, work that takes time on others.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/server/service.h"

namespace btms {

struct HttpOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: any that is free
  int threads = 2;            // that read and write; as many work
};

class HttpServer {
 public:
  // Listens from now on. Throws Error(kUsage) when the address or port can't be had. The service must outlive it.
  HttpServer(Service& service, const HttpOptions& options);
  ~HttpServer();
  std::uint16_t port() const;

  // Serves until stop(), or a signal of these two: SIGINT, SIGTERM. Then finishes the requests that are at work.
  // `warn` is told of revisions that can't be opened.
  void run(const std::function<void(const std::string&)>& warn);
  void stop();  // from any thread

  class Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace btms
