// A client of the tile server that may behave as badly as a test wants.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>

namespace btms::test {

// A connection to the server.
class SocketClient {
 public:
  explicit SocketClient(std::uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    closed_ = connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0;
  }
  ~SocketClient() { close(fd_); }
  SocketClient(const SocketClient&) = delete;

  // False when the server has closed.
  bool send(const std::string& bytes) const {
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t n = ::send(fd_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (n <= 0) return false;
      at += static_cast<std::size_t>(n);
    }
    return true;
  }
  // What comes until the text is there, the server closes, or so long has passed.
  std::string read_until(const std::string& text, std::chrono::milliseconds most = std::chrono::seconds(5)) {
    const auto end = std::chrono::steady_clock::now() + most;
    while (got_.find(text) == std::string::npos) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
      pollfd ready{fd_, POLLIN, 0};
      if (left.count() <= 0 || poll(&ready, 1, static_cast<int>(left.count())) <= 0) break;
      char piece[4096];
      const ssize_t n = recv(fd_, piece, sizeof piece, 0);
      if (n <= 0) {
        closed_ = true;
        break;
      }
      got_.append(piece, static_cast<std::size_t>(n));
    }
    return got_;
  }
  std::string rest() { return read_until("\1 never"); }
  bool closed() const { return closed_; }
  void forget() { got_.clear(); }

 private:
  int fd_;
  std::string got_;
  bool closed_ = false;
};

}  // namespace btms::test
