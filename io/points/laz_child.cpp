#include "io/points/laz_child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string_view>

#include "engine/error.h"
#include "io/files/descriptor.h"
#include "io/points/input_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& what, const fs::path& path) {
  throw Error(ErrorCode::kFailed, "cannot start the LAZ decoder: " + what, path.string());
}

// In PATH, as a shell would find it.
std::string find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::string_view folders = path ? path : "/usr/local/bin:/usr/bin:/bin";
  while (!folders.empty()) {
    const std::string_view folder = folders.substr(0, folders.find(':'));
    folders.remove_prefix(std::min(folder.size() + 1, folders.size()));
    const fs::path program = fs::path(folder) / name;
    if (program.is_absolute() && ::access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

struct Pipe {
  Descriptor read, write;
  explicit Pipe(const fs::path& path) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) fail(system_reason(errno), path);
    read = Descriptor(ends[0]);
    write = Descriptor(ends[1]);
  }
};

void limit(int resource, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

// Between fork and exec only calls that are safe after the fork of a process with threads.
[[noreturn]] void be_the_child(char* const* arguments, pid_t parent, int in, int out, int err) {
  constexpr int kNotStarted = 127;
  // WebAssembly asks for 10 GB of addresses, so these can't be limited; what is written to can.
  constexpr rlim_t kMostMemory_bytes = rlim_t{6} << 30;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kNotStarted);
  for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP}) ::signal(signal, signal == SIGINT ? SIG_IGN : SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  const int high_in = ::fcntl(in, F_DUPFD, 10), high_out = ::fcntl(out, F_DUPFD, 10),
            high_err = ::fcntl(err, F_DUPFD, 10);
  if (::dup2(high_in, 0) != 0 || ::dup2(high_out, 1) != 1 || ::dup2(high_err, 2) != 2 || ::close_range(3, ~0U, 0) != 0)
    ::_exit(kNotStarted);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);  // of files; pipes have none
  limit(RLIMIT_NOFILE, 64);
  limit(RLIMIT_DATA, kMostMemory_bytes);
  char* const environment[] = {nullptr};
  ::execve(arguments[0], arguments, environment);
  ::_exit(kNotStarted);
}

class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ < 0) return;
    ::kill(pid_, SIGKILL);
    wait();
  }
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
};

// What it said, on one line and not too long.
std::string tidy(std::string words) {
  constexpr std::size_t kMost = 400;
  words.resize(std::min(words.size(), kMost));
  std::replace_if(
      words.begin(), words.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return words;
}

}  // namespace

LazDecoder LazDecoder::built(const fs::path& path, std::uint64_t points, std::uint16_t record_bytes) {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path script = program.parent_path().parent_path() / "share/btms/laz/decode.js";
  const std::string node = find_program("node");
  const char* const advice = "; or decompress the file to .las first";
  if (node.empty())
    throw Error(ErrorCode::kFailed, std::string("reading LAZ needs node: install the package nodejs") + advice,
                path.string());
  if (!fs::is_regular_file(script, ignored)) {
    throw Error(
        ErrorCode::kFailed,
        std::string("this build has no LAZ decoder: install npm (cmake/install-deps.sh --laz) and build again") +
            advice,
        path.string());
  }
  return {{node, script, std::to_string(points), std::to_string(record_bytes)}};
}

void run_laz_decoder(const LazDecoder& decoder, const fs::path& path, std::uint64_t bytes,
                     const std::function<void(std::span<const std::uint8_t>)>& sink) {
  const InputFile input(path);
  Descriptor in(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (in.get() < 0) throw_input_error(errno, "open", path);
  Pipe out(path), err(path);
  std::vector<std::string> words = decoder.command;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) fail(system_reason(errno), path);
  if (pid == 0) be_the_child(arguments.data(), parent, in.get(), out.write.get(), err.write.get());
  Child child(pid);
  out.write.close();
  err.write.close();

  constexpr std::size_t kPiece = std::size_t{1} << 18, kMostWords = 4096;
  std::vector<std::uint8_t> piece(kPiece);
  std::string said;
  std::uint64_t got_bytes = 0;
  pollfd ends[] = {{out.read.get(), POLLIN, 0}, {err.read.get(), POLLIN, 0}};
  using Clock = std::chrono::steady_clock;
  auto last = Clock::now();
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    if (Clock::now() - last > std::chrono::seconds(decoder.patience_s))
      input.refuse("the LAZ decoder was stopped: it said nothing for " + std::to_string(decoder.patience_s) + " s");
    if (::poll(ends, 2, 200) <= 0) continue;
    for (pollfd& end : ends) {
      if (end.fd < 0 || end.revents == 0) continue;
      const ssize_t n = ::read(end.fd, piece.data(), piece.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        end.fd = -1;
        continue;
      }
      const auto got = static_cast<std::size_t>(n);
      if (&end == &ends[1]) {
        said.append(piece.begin(),
                    piece.begin() + static_cast<std::ptrdiff_t>(std::min(got, kMostWords - said.size())));
        continue;
      }
      last = Clock::now();
      if (got > bytes - got_bytes) input.refuse("the LAZ decoder gave more than the header declares");
      got_bytes += got;
      sink(std::span(piece).first(got));
    }
  }
  const int status = child.wait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127 && said.empty()) fail(decoder.command[0], path);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const std::string how = WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                                : "exit status " + std::to_string(WEXITSTATUS(status));
    input.refuse("cannot be decompressed: " + (said.empty() ? "the LAZ decoder ended with " + how : tidy(said)));
  }
  if (got_bytes != bytes)
    input.refuse("cannot be decompressed: found " + std::to_string(got_bytes) + " bytes of points, expected " +
                 std::to_string(bytes));
}

}  // namespace btms
