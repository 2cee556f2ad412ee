// A server on loopback that answers what a test tells it to, byte for byte.
#pragma once

#include <utility>  // before Asio, which lacks it

#include <poll.h>

#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "io/client/http_client.h"

namespace btms::test {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using FakeRequest = http::request<http::string_body>;

class FakeServer {
 public:
  // What goes back; the connection is then ended if `end`.
  struct Reply {
    std::string bytes;
    bool end = false;
    std::chrono::milliseconds pause{0};  // before every piece of `piece` bytes
    std::size_t piece = std::size_t{1} << 30;
  };
  explicit FakeServer(std::function<Reply(const FakeRequest&)> answer)
      : answer_(std::move(answer)), acceptor_(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0)) {
    thread_ = std::thread([this] { serve(); });
  }
  ~FakeServer() {
    stopping_ = true;
    boost::system::error_code ignored;
    tcp::socket(io_).connect(acceptor_.local_endpoint(), ignored);  // wakes accept()
    thread_.join();
    for (std::thread& t : connections_) t.join();
  }
  ClientOptions options() const {
    ClientOptions options;
    options.url = "http://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port());
    options.answer = std::chrono::milliseconds(2000);
    return options;
  }
  std::atomic<int> connections{0}, requests{0};

 private:
  void serve() {
    while (true) {
      auto socket = std::make_shared<tcp::socket>(io_);
      acceptor_.accept(*socket);
      if (stopping_) return;
      ++connections;
      connections_.emplace_back([this, socket] { converse(*socket); });
    }
  }
  void converse(tcp::socket& socket) {
    boost::beast::flat_buffer buffer;
    boost::system::error_code error;
    while (!stopping_) {
      // Poll, so that a test's end is not kept waiting by a client that says nothing.
      if (buffer.size() == 0 && socket.available(error) == 0 && !error) {
        pollfd ready{socket.native_handle(), POLLIN, 0};
        if (poll(&ready, 1, 20) == 0) continue;
      }
      FakeRequest request;
      http::read(socket, buffer, request, error);
      if (error) return;
      ++requests;
      const Reply reply = answer_(request);
      for (std::size_t at = 0; at < reply.bytes.size() && !error && !stopping_; at += reply.piece) {
        std::this_thread::sleep_for(reply.pause);
        asio::write(socket, asio::buffer(reply.bytes.data() + at, std::min(reply.piece, reply.bytes.size() - at)),
                    error);
      }
      if (reply.end || error) {
        socket.shutdown(tcp::socket::shutdown_both, error);
        return;
      }
    }
  }

  std::function<Reply(const FakeRequest&)> answer_;
  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> connections_;
  std::thread thread_;
};

inline std::string head(const std::string& status, const std::string& headers) {
  return "HTTP/1.1 " + status + "\r\n" + headers + "\r\n";
}
inline std::string whole(const std::string& status, const std::string& headers, const std::string& body) {
  return head(status, headers + "Content-Length: " + std::to_string(body.size()) + "\r\n") + body;
}
inline std::string json(const std::string& body) { return whole("200 OK", "Content-Type: application/json\r\n", body); }

}  // namespace btms::test
