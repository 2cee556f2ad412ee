#include "bench/macro/child.h"

#include <fcntl.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <stdexcept>

extern char** environ;

namespace btms::bench {
namespace {

[[noreturn]] void fail(const std::vector<std::string>& command, const std::string& how) {
  throw std::runtime_error(fmt::format("`{}` {}", fmt::join(command, " "), how));
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

// Of a child that has ended and was not waited for yet.
void count_bytes(pid_t child, Cost& cost) {
  std::ifstream io(fmt::format("/proc/{}/io", child));
  std::string name;
  for (std::uint64_t bytes = 0; io >> name >> bytes;) {
    if (name == "rchar:") cost.read_bytes = bytes;
    if (name == "wchar:") cost.written_bytes = bytes;
  }
}

}  // namespace

ChildRun run_child(const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail(command, std::strerror(errno));
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ChildRun run;
  pid_t child = 0;
  const auto begun = std::chrono::steady_clock::now();
  const int error = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (error != 0) {
    ::close(ends[0]);
    fail(command, std::string("cannot be started: ") + std::strerror(error));
  }

  char buffer[4096];
  for (ssize_t n = 0; (n = ::read(ends[0], buffer, sizeof buffer)) > 0 || (n < 0 && errno == EINTR);)
    if (n > 0) run.output.append(buffer, static_cast<std::size_t>(n));
  ::close(ends[0]);
  siginfo_t ended{};
  while (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) continue;
  run.cost.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  count_bytes(child, run.cost);

  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) continue;
  run.cost.user_s = seconds(usage.ru_utime);
  run.cost.system_s = seconds(usage.ru_stime);
  run.cost.peak_rss_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  if (WIFSIGNALED(status)) fail(command, fmt::format("was ended by signal {}", WTERMSIG(status)));
  if (WEXITSTATUS(status) != 0) fail(command, fmt::format("failed with status {}", WEXITSTATUS(status)));
  return run;
}

}  // namespace btms::bench
