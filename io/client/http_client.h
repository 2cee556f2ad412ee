// HTTP/1.1 over one connection that is kept: what the clients of a tile server are made of.
//
// A server is a stranger: headers and bodies are bounded before memory is taken, everything has a deadline, redirects
// are refused, and an answer is whole or an error. Errors are btms::Error: kUsage for a request the server refuses
// (4xx), kCancelled after stop(), kBadInput for an answer that breaks the rules, kFailed for everything that may go
// better later (no connection, too slow, 5xx).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace btms {

struct ClientOptions {
  std::string url;                            // http://host[:port][/prefix]
  std::string token;                          // sent as Authorization: Bearer, or empty
  std::chrono::milliseconds connect{3'000};   // to be connected
  std::chrono::milliseconds answer{15'000};   // from the request to the end of its answer
  std::chrono::milliseconds silence{45'000};  // of a stream: three of the server's comments
  std::size_t header_bytes = 16 << 10;        // of an answer
  std::size_t body_bytes = std::size_t{32} << 20;
};

using HttpHeaders = std::map<std::string, std::string>;  // names in lower case

struct HttpAnswer {
  int status = 0;  // 200 to 299, or 304
  HttpHeaders headers;
  std::vector<std::uint8_t> body;

  std::string header(const std::string& name) const {
    const auto it = headers.find(name);
    return it == headers.end() ? std::string() : it->second;
  }
};

// One thread at a time; stop() from any.
class HttpClient {
 public:
  // Connects with the first request. Throws Error(kUsage) for a URL that is none, and for https: let a proxy on this
  // machine do that.
  explicit HttpClient(ClientOptions options);
  ~HttpClient();
  HttpClient(HttpClient&&) noexcept;

  // `target` begins with / and is put behind the URL's prefix. A request that a kept connection dies under is sent
  // once more: requests to a tile server change nothing.
  HttpAnswer get(const std::string& target, const HttpHeaders& headers = {});
  HttpAnswer post(const std::string& target, std::span<const std::uint8_t> body, const std::string& content_type);

  // An answer without an end. Calls `heard` with nothing when its head is there (status 200), then with every piece as
  // it comes, until that returns false, the server ends it or is silent for too long (Error(kFailed)). The connection
  // is not kept. Precondition: what the answer's Content-Type begins with.
  void stream(const std::string& target, const HttpHeaders& headers, const std::string& content_type,
              const std::function<bool(std::string_view)>& heard);

  // Whatever is under way and everything later throws Error(kCancelled). Looking up a host's name is not cut short.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// For a segment of a path, or a value in a query.
std::string percent_encoded(std::string_view text);

}  // namespace btms
