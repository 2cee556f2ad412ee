// Ranks as forked processes. Every pair is joined by a socket pair; an exchange sends every message with its length in
// front and receives at the same time, so no order of sending can deadlock.
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>

#include "engine/error.h"
#include "engine/tiling/executor.h"

namespace btms {
namespace {

// One message on its way to, and one on its way from, another rank.
struct Transfer {
  int fd = -1;
  std::uint64_t send_size = 0;
  const std::uint8_t* send_data = nullptr;
  std::uint64_t sent = 0;  // header bytes included
  std::uint64_t receive_size = 0;
  Bytes* receive_data = nullptr;
  std::uint64_t received = 0;

  static constexpr std::uint64_t kHeader = sizeof(std::uint64_t);
  bool sending() const { return sent < kHeader + send_size; }
  bool receiving() const { return received < kHeader || received < kHeader + receive_size; }

  // Both return false when the other side is gone.
  bool send_some() {
    const bool header = sent < kHeader;
    const auto* from = header ? reinterpret_cast<const std::uint8_t*>(&send_size) + sent : send_data + (sent - kHeader);
    const std::uint64_t left = header ? kHeader - sent : kHeader + send_size - sent;
    const ssize_t n = ::send(fd, from, left, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    sent += static_cast<std::uint64_t>(n);
    return true;
  }
  bool receive_some() {
    const bool header = received < kHeader;
    auto* to = header ? reinterpret_cast<std::uint8_t*>(&receive_size) + received : receive_data->data() + (received - kHeader);
    const std::uint64_t left = header ? kHeader - received : kHeader + receive_size - received;
    const ssize_t n = ::recv(fd, to, left, MSG_DONTWAIT);
    if (n == 0) return false;
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    received += static_cast<std::uint64_t>(n);
    if (header && received == kHeader) receive_data->resize(receive_size);
    return true;
  }
};

class ForkedRanks final : public Ranks {
 public:
  // sockets[r] leads to rank r; sockets[rank] is unused.
  ForkedRanks(int rank, std::vector<int> sockets) : rank_(rank), sockets_(std::move(sockets)) {}
  ~ForkedRanks() override {
    for (const int fd : sockets_)
      if (fd >= 0) ::close(fd);
  }
  ForkedRanks(const ForkedRanks&) = delete;
  ForkedRanks& operator=(const ForkedRanks&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(sockets_.size()); }

  std::vector<Bytes> exchange(std::vector<Bytes> out) override {
    std::vector<Bytes> in(sockets_.size());
    std::vector<Transfer> transfers;
    for (std::size_t r = 0; r < sockets_.size(); ++r) {
      if (static_cast<int>(r) == rank_) continue;
      Transfer t;
      t.fd = sockets_[r];
      t.send_size = out[r].size();
      t.send_data = out[r].data();
      t.receive_data = &in[r];
      transfers.push_back(t);
    }
    std::vector<pollfd> waiting;
    for (;;) {
      waiting.clear();
      for (const Transfer& t : transfers) {
        const int events = (t.sending() ? POLLOUT : 0) | (t.receiving() ? POLLIN : 0);
        waiting.push_back({events ? t.fd : -1, static_cast<short>(events), 0});
      }
      bool busy = false;
      for (const pollfd& p : waiting) busy |= p.fd >= 0;
      if (!busy) break;
      if (::poll(waiting.data(), waiting.size(), -1) < 0) {
        if (errno == EINTR) continue;
        throw Error(ErrorCode::kFailed, std::string("waiting for other ranks: ") + std::strerror(errno));
      }
      for (std::size_t i = 0; i < transfers.size(); ++i) {
        Transfer& t = transfers[i];
        bool alive = true;
        if (t.receiving() && (waiting[i].revents & (POLLIN | POLLHUP | POLLERR))) alive = t.receive_some();
        if (alive && t.sending() && (waiting[i].revents & (POLLOUT | POLLERR))) alive = t.send_some();
        if (!alive) throw Error(ErrorCode::kFailed, "another rank ended in the middle of an exchange");
      }
    }
    in[static_cast<std::size_t>(rank_)] = std::move(out[static_cast<std::size_t>(rank_)]);
    return in;
  }

 private:
  int rank_;
  std::vector<int> sockets_;
};

// Writes all of it, however often the pipe is interrupted.
void write_all(int fd, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    done += static_cast<std::size_t>(n);
  }
}

std::string read_all(int fd) {
  std::string text;
  char buffer[512];
  for (;;) {
    const ssize_t n = ::read(fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(buffer, static_cast<std::size_t>(n));
  }
}

// Runs one rank to its end. What it throws is reported as "code message".
std::string run_rank(Ranks& ranks, const std::function<void(Ranks&)>& body) {
  try {
    body(ranks);
    return {};
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code())) + ' ' + e.what();
  } catch (const std::exception& e) {
    return std::to_string(static_cast<int>(ErrorCode::kFailed)) + ' ' + e.what();
  }
}

struct Child {
  pid_t pid = -1;
  int report = -1;  // read end of the pipe its error comes through
};

}  // namespace

void run_forked_ranks(int n, const std::function<void(Ranks&)>& body) {
  const auto count = static_cast<std::size_t>(n);
  // sockets[a][b] is rank a's end of the pair it shares with rank b.
  std::vector<std::vector<int>> sockets(count, std::vector<int>(count, -1));
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b) {
      int pair[2];
      if (::socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0)
        throw Error(ErrorCode::kFailed, std::string("can't join ranks by socket pairs: ") + std::strerror(errno));
      sockets[a][b] = pair[0];
      sockets[b][a] = pair[1];
    }
  const auto close_others = [&](std::size_t mine) {
    for (std::size_t a = 0; a < count; ++a)
      if (a != mine)
        for (const int fd : sockets[a])
          if (fd >= 0) ::close(fd);
  };

  std::vector<Child> children;
  for (std::size_t rank = 1; rank < count; ++rank) {
    int report[2];
    const bool piped = ::pipe(report) == 0;
    const pid_t pid = piped ? ::fork() : -1;
    if (pid < 0) {
      for (const Child& c : children) ::kill(c.pid, SIGKILL), ::waitpid(c.pid, nullptr, 0);
      throw Error(ErrorCode::kFailed, std::string("can't start another rank: ") + std::strerror(errno));
    }
    if (pid == 0) {
      for (const Child& c : children) ::close(c.report);
      ::close(report[0]);
      close_others(rank);
      std::string failure;
      {
        ForkedRanks ranks(static_cast<int>(rank), sockets[rank]);
        failure = run_rank(ranks, body);
      }
      write_all(report[1], failure);
      ::_exit(failure.empty() ? 0 : 1);
    }
    ::close(report[1]);
    children.push_back({pid, report[0]});
  }
  close_others(0);

  std::exception_ptr mine;
  {
    ForkedRanks ranks(0, sockets[0]);
    try {
      body(ranks);
    } catch (...) {
      mine = std::current_exception();
    }
  }
  // A rank that fails by itself is the cause; the others only noticed that it was gone.
  std::string cause;
  for (std::size_t i = 0; i < children.size(); ++i) {
    const std::string report = read_all(children[i].report);
    ::close(children[i].report);
    int status = 0;
    while (::waitpid(children[i].pid, &status, 0) < 0 && errno == EINTR) {
    }
    const std::string who = "rank " + std::to_string(i + 1);
    if (WIFSIGNALED(status)) cause = "0 " + who + " was killed by signal " + std::to_string(WTERMSIG(status));
    else if (!report.empty() && report.find("ended in the middle") == std::string::npos && cause.empty()) cause = report;
  }
  if (!cause.empty()) {
    const std::size_t space = cause.find(' ');
    const auto code = static_cast<ErrorCode>(std::stoi(cause.substr(0, space)));
    throw Error(code, cause.substr(space + 1));
  }
  if (mine) std::rethrow_exception(mine);
}

}  // namespace btms
