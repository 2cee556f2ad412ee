#include "io/store/sandbox.h"

#include <fcntl.h>
#include <poll.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "engine/error.h"
#include "io/files/descriptor.h"

namespace btms {
namespace {

// The child's descriptors: all it has.
constexpr int kData = 0, kWords = 1;
// What its last words begin with.
constexpr char kMessage = 'm', kRefusedCall = 'c';
constexpr std::size_t kMostWords_bytes = 2000;
constexpr int kDone = 0, kSaidWhy = 3, kNotSetUp = 4;  // how it exits

struct ChildEnded {};
struct TimeIsOver {};

std::int64_t now_ms() {
  using std::chrono::milliseconds, std::chrono::steady_clock;
  return std::chrono::duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count();
}

bool write_all(int fd, const void* bytes, std::size_t n) {
  const char* p = static_cast<const char*>(bytes);
  while (n > 0) {
    const ssize_t put = ::write(fd, p, n);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    p += put;
    n -= static_cast<std::size_t>(put);
  }
  return true;
}

[[noreturn]] void say_and_exit(char kind, const char* text) {
  write_all(kWords, &kind, 1);
  write_all(kWords, text, std::min(std::strlen(text), kMostWords_bytes));
  ::_exit(kSaidWhy);
}

void on_refused_call(int, siginfo_t* info, void*) {
  char digits[16];
  std::snprintf(digits, sizeof digits, "%d", info->si_syscall);
  say_and_exit(kRefusedCall, digits);
}

std::uint64_t address_space_bytes() {
  unsigned long long pages = 0;
  if (FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool set_limit(int resource, std::uint64_t soft, std::uint64_t hard) {
  rlimit limit{};
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return false;
  limit.rlim_max = std::min<rlim_t>(limit.rlim_max, hard);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, soft);
  return ::setrlimit(static_cast<__rlimit_resource>(resource), &limit) == 0;
}

bool set_limits(const SandboxLimits& limits) {
  const std::uint64_t has = address_space_bytes();
  const auto seconds = static_cast<std::uint64_t>(limits.seconds);
  return has > 0 && set_limit(RLIMIT_AS, has + limits.memory_bytes, has + limits.memory_bytes) &&
         set_limit(RLIMIT_CPU, seconds, seconds + 1) && set_limit(RLIMIT_FSIZE, 0, 0) && set_limit(RLIMIT_CORE, 0, 0) &&
         set_limit(RLIMIT_NPROC, 0, 0) && set_limit(RLIMIT_NOFILE, 0, 0);
}

// Memory, time, an end, and writing to the parent. Anything else is refused, and told.
bool allow_computing_only() {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_TRAP);
  if (!filter) return false;
  bool good = true;
  const auto allow = [&](int call) { good = good && seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0) == 0; };
  for (const int call :
       {SCMP_SYS(brk), SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(exit),
        SCMP_SYS(exit_group), SCMP_SYS(rt_sigreturn), SCMP_SYS(rt_sigprocmask), SCMP_SYS(restart_syscall),
        SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday), SCMP_SYS(getpid), SCMP_SYS(gettid), SCMP_SYS(sched_yield)})
    allow(call);
  const auto allow_if = [&](int call, std::initializer_list<scmp_arg_cmp> conditions) {
    good = good && seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, call, static_cast<unsigned>(conditions.size()),
                                          conditions.begin()) == 0;
  };
  const scmp_arg_cmp not_executable = SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0);
  allow_if(SCMP_SYS(mmap), {not_executable, SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_ANONYMOUS, MAP_ANONYMOUS)});
  allow_if(SCMP_SYS(mprotect), {not_executable});
  allow_if(SCMP_SYS(write), {SCMP_A0(SCMP_CMP_LE, kWords)});
  allow_if(SCMP_SYS(tgkill), {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(::getpid()))});  // abort()
  // No file exists: HDF5 looks whether one has the name of an image. The C library's complaint before an abort() goes
  // nowhere.
  const auto answer = [&](int call, std::uint32_t error) {
    good = good && seccomp_rule_add(filter, SCMP_ACT_ERRNO(error), call, 0) == 0;
  };
  answer(SCMP_SYS(open), ENOENT);
  answer(SCMP_SYS(openat), ENOENT);
  answer(SCMP_SYS(writev), EBADF);
  good = good && seccomp_load(filter) == 0;
  seccomp_release(filter);
  return good;
}

// Leaves only the two descriptors, under their numbers.
bool keep_pipes_only(int data, int words) {
  const int high_data = ::fcntl(data, F_DUPFD, 10), high_words = ::fcntl(words, F_DUPFD, 10);
  return high_data >= 0 && high_words >= 0 && ::dup2(high_data, kData) == kData &&
         ::dup2(high_words, kWords) == kWords && ::close_range(kWords + 1, ~0U, 0) == 0;
}

[[noreturn]] void be_the_child(const SandboxLimits& limits, int data, int words,
                               const std::function<void(SandboxOutput&)>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_DUMPABLE, 0);
  struct sigaction refused {};
  refused.sa_sigaction = on_refused_call;
  refused.sa_flags = SA_SIGINFO;
  ::sigaction(SIGSYS, &refused, nullptr);
  for (const int signal : {SIGPIPE, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGXCPU}) ::signal(signal, SIG_DFL);
  // The terminal's Ctrl-C is the parent's business.
  ::signal(SIGINT, SIG_IGN);
  if (!keep_pipes_only(data, words) || !set_limits(limits) || !allow_computing_only()) ::_exit(kNotSetUp);
  try {
    SandboxOutput output(kData);
    work(output);
  } catch (const std::bad_alloc&) {
    say_and_exit(kMessage, "it wants more memory than it may have");
  } catch (const std::exception& e) {
    say_and_exit(kMessage, e.what());
  } catch (...) {
    say_and_exit(kMessage, "unknown reason");
  }
  ::_exit(kDone);
}

std::string call_name(const std::string& number) {
  char* const name = seccomp_syscall_resolve_num_arch(SCMP_ARCH_NATIVE, std::atoi(number.c_str()));
  const std::string text = name ? name : "number " + number;
  std::free(name);
  return text;
}

class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() {
    if (!reaped_) {
      ::kill(pid_, SIGKILL);
      wait();
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void kill() const { ::kill(pid_, SIGKILL); }
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    reaped_ = true;
    return status;
  }

 private:
  const pid_t pid_;
  bool reaped_ = false;
};

// Text the child left; it has ended.
std::string read_words(int fd) {
  std::string text(kMostWords_bytes + 1, '\0');
  std::size_t n = 0;
  for (ssize_t got = 1; got != 0 && n < text.size();) {
    got = ::read(fd, text.data() + n, text.size() - n);
    if (got < 0 && errno != EINTR) break;
    if (got > 0) n += static_cast<std::size_t>(got);
  }
  text.resize(n);
  return text;
}

[[noreturn]] void fail(const std::string& why) { throw Error(ErrorCode::kVerification, why); }

// How a child ended that didn't do its work; of its text only what can be printed.
[[noreturn]] void throw_end(int status, std::string words) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU) fail("the sandboxed reader was stopped: it took more time than it may have");
    fail("the sandboxed reader was killed by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")");
  }
  if (WEXITSTATUS(status) == kNotSetUp)
    throw Error(ErrorCode::kFailed, "this system can't sandbox a reader (seccomp and resource limits are needed)");
  for (char& c : words)
    if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
  if (WEXITSTATUS(status) != kSaidWhy || words.size() < 2) fail("the sandboxed reader ended without an answer");
  if (words[0] == kRefusedCall) fail("the sandboxed reader was refused the system call " + call_name(words.substr(1)));
  fail(words.substr(1));
}

}  // namespace

void SandboxOutput::write(std::span<const std::uint8_t> bytes) {
  if (!write_all(fd_, bytes.data(), bytes.size())) ::_exit(kDone);  // nobody listens any more
}

void SandboxInput::read(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const std::int64_t left_ms = deadline_ms_ - now_ms();
    if (left_ms <= 0) throw TimeIsOver{};
    pollfd wait{fd_, POLLIN, 0};
    if (::poll(&wait, 1, static_cast<int>(std::min<std::int64_t>(left_ms, 1000))) <= 0) continue;
    const ssize_t got = ::read(fd_, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw ChildEnded{};
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

void run_sandboxed(const SandboxLimits& limits, const std::function<void(SandboxOutput&)>& work,
                   const std::function<void(SandboxInput&)>& consume) {
  int data[2], words[2];
  const auto failed = [](const char* what) {
    throw Error(ErrorCode::kFailed,
                std::string("could not start a sandboxed reader: ") + what + ": " + std::strerror(errno));
  };
  if (::pipe2(data, O_CLOEXEC) != 0) failed("pipe");
  Descriptor data_in(data[0]), data_out(data[1]);
  if (::pipe2(words, O_CLOEXEC) != 0) failed("pipe");
  Descriptor words_in(words[0]), words_out(words[1]);
  const pid_t pid = ::fork();
  if (pid < 0) failed("fork");
  if (pid == 0) be_the_child(limits, data_out.get(), words_out.get(), work);
  Child child(pid);
  data_out.close();
  words_out.close();
  const std::int64_t most_ms = 10'000 + std::int64_t{4000} * limits.seconds;
  SandboxInput input(data_in.get(), now_ms() + most_ms);
  try {
    consume(input);
    std::uint8_t more = 0;
    try {
      input.read({&more, 1});
    } catch (const ChildEnded&) {
      const int status = child.wait();
      if (WIFEXITED(status) && WEXITSTATUS(status) == kDone) return;
      throw_end(status, read_words(words_in.get()));
    }
    fail("the sandboxed reader said more than it was asked");
  } catch (const ChildEnded&) {
    const int status = child.wait();
    throw_end(status, read_words(words_in.get()));
  } catch (const TimeIsOver&) {
    child.kill();
    fail("the sandboxed reader was stopped: it gave no answer for " + std::to_string(most_ms / 1000) + " s");
  }
}

}  // namespace btms
