// Ranks as forked processes. Every pair is joined by a socket pair; an exchange sends every message with its length in
// front and receives at the same time, so no order of sending can deadlock.
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <new>
#include <sstream>
#include <utility>

#include "engine/error.h"
#include "engine/tiling/executor.h"

namespace btms {
namespace {

// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& o) noexcept {
    reset();
    fd_ = std::exchange(o.fd_, -1);
    return *this;
  }
  ~Descriptor() { reset(); }
  int get() const { return fd_; }
  void reset() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

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
    auto* to = header ? reinterpret_cast<std::uint8_t*>(&receive_size) + received
                      : receive_data->data() + (received - kHeader);
    const std::uint64_t left = header ? kHeader - received : kHeader + receive_size - received;
    const ssize_t n = ::recv(fd, to, left, MSG_DONTWAIT);
    if (n == 0) return false;
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    received += static_cast<std::uint64_t>(n);
    if (header && received == kHeader) receive_data->resize(receive_size);
    return true;
  }
};

// Thrown by exchange() when another rank is gone; the cause is that rank's own error.
class RankGone : public Error {
 public:
  RankGone() : Error(ErrorCode::kFailed, "another rank ended in the middle of an exchange") {}
};

class ForkedRanks final : public Ranks {
 public:
  // sockets[r] leads to rank r; sockets[rank] is unused.
  ForkedRanks(int rank, std::vector<Descriptor> sockets) : rank_(rank), sockets_(std::move(sockets)) {}

  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(sockets_.size()); }

 private:
  std::vector<Bytes> do_exchange(std::vector<Bytes> out) override {
    std::vector<Bytes> in(sockets_.size());
    std::vector<Transfer> transfers;
    for (std::size_t r = 0; r < sockets_.size(); ++r) {
      if (static_cast<int>(r) == rank_) continue;
      Transfer t;
      t.fd = sockets_[r].get();
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
        throw Error(ErrorCode::kFailed, "waiting for other ranks: " + system_reason(errno));
      }
      for (std::size_t i = 0; i < transfers.size(); ++i) {
        Transfer& t = transfers[i];
        bool alive = true;
        if (t.receiving() && (waiting[i].revents & (POLLIN | POLLHUP | POLLERR))) alive = t.receive_some();
        if (alive && t.sending() && (waiting[i].revents & (POLLOUT | POLLERR))) alive = t.send_some();
        if (!alive) throw RankGone();
      }
    }
    in[static_cast<std::size_t>(rank_)] = std::move(out[static_cast<std::size_t>(rank_)]);
    return in;
  }

  int rank_;
  std::vector<Descriptor> sockets_;
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

// A rank's failure as it travels through its pipe: "code noticed offset file-length\nfile message". `noticed` = 1 when
// the rank only noticed that another had ended.
std::string report_of(const Error& e, bool noticed) {
  const std::string what = e.what();
  const std::string prefix = Error(e.code(), "", e.file(), e.offset()).what();
  return std::to_string(static_cast<int>(e.code())) + ' ' + (noticed ? '1' : '0') + ' ' +
         (e.offset() ? std::to_string(*e.offset()) : "-") + ' ' + std::to_string(e.file().size()) + '\n' + e.file() +
         what.substr(std::min(prefix.size(), what.size()));
}

struct RankFailure {
  Error error;
  bool noticed;
};

RankFailure failure_of(const std::string& report) {
  std::istringstream head(report.substr(0, report.find('\n')));
  int code = 0, noticed = 0;
  std::string offset;
  std::size_t length = 0;
  head >> code >> noticed >> offset >> length;
  const std::string rest = report.substr(report.find('\n') + 1);
  return {Error(static_cast<ErrorCode>(code), rest.substr(length), rest.substr(0, length),
                offset == "-" ? std::nullopt : std::optional<std::uint64_t>(std::stoull(offset))),
          noticed == 1};
}

// Runs one rank to its end. Returns its report, empty when all went well.
std::string run_rank(Ranks& ranks, const std::function<void(Ranks&)>& body) {
  try {
    body(ranks);
    return {};
  } catch (const RankGone& e) {
    return report_of(e, true);
  } catch (const Error& e) {
    return report_of(e, false);
  } catch (const std::bad_alloc&) {
    return report_of(Error(ErrorCode::kFailed, kOutOfMemory), false);
  } catch (const std::exception& e) {
    return report_of(Error(ErrorCode::kFailed, e.what()), false);
  } catch (...) {
    return report_of(Error(ErrorCode::kFailed, "unknown exception"), false);
  }
}

struct Child {
  pid_t pid = -1;
  Descriptor report;  // read end of the pipe its failure comes through
};

[[noreturn]] void cannot_start(const std::vector<Child>& started) {
  const std::string reason = system_reason(errno);
  for (const Child& c : started) {
    ::kill(c.pid, SIGKILL);
    ::waitpid(c.pid, nullptr, 0);
  }
  throw Error(ErrorCode::kFailed, "can't start another rank: " + reason);
}

}  // namespace

void run_forked_ranks(int n, const std::function<void(Ranks&)>& body) {
  const auto count = static_cast<std::size_t>(n);
  std::vector<Child> children;
  // sockets[a][b] is rank a's end of the pair it shares with rank b.
  std::vector<std::vector<Descriptor>> sockets(count);
  for (auto& row : sockets) row.resize(count);
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b) {
      int pair[2];
      if (::socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) cannot_start(children);
      sockets[a][b] = Descriptor(pair[0]);
      sockets[b][a] = Descriptor(pair[1]);
    }

  for (std::size_t rank = 1; rank < count; ++rank) {
    int ends[2];
    if (::pipe(ends) != 0) cannot_start(children);
    Descriptor read_end(ends[0]), write_end(ends[1]);
    const pid_t pid = ::fork();
    if (pid < 0) cannot_start(children);
    if (pid == 0) {
      children.clear();
      read_end.reset();
      std::string report;
      {
        ForkedRanks ranks(static_cast<int>(rank), std::move(sockets[rank]));
        sockets.clear();
        report = run_rank(ranks, body);
      }
      write_all(write_end.get(), report);
      ::_exit(report.empty() ? 0 : 1);
    }
    children.push_back({pid, std::move(read_end)});
  }

  std::string mine;
  {
    ForkedRanks ranks(0, std::move(sockets[0]));
    sockets.clear();
    mine = run_rank(ranks, body);
  }
  // A rank that fails by itself is the cause; the others only noticed that it was gone.
  std::vector<RankFailure> failures;
  if (!mine.empty()) failures.push_back(failure_of(mine));
  for (std::size_t i = 0; i < children.size(); ++i) {
    const std::string report = read_all(children[i].report.get());
    int status = 0;
    while (::waitpid(children[i].pid, &status, 0) < 0 && errno == EINTR) {
    }
    const std::string who = "rank " + std::to_string(i + 1);
    if (WIFSIGNALED(status))
      failures.push_back(
          {Error(ErrorCode::kFailed, who + " was killed by signal " + std::to_string(WTERMSIG(status))), false});
    else if (!report.empty())
      failures.push_back(failure_of(report));
    else if (status != 0)
      failures.push_back(
          {Error(ErrorCode::kFailed, who + " ended with status " + std::to_string(WEXITSTATUS(status))), false});
  }
  for (const RankFailure& f : failures)
    if (!f.noticed) throw f.error;
  if (!failures.empty()) throw failures.front().error;
}

}  // namespace btms
