// Work on bytes of unknown origin, in a child process that can only compute and answer: no files, no network, no other
// processes, bounded memory and time. Whatever becomes of the child, the parent goes on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace btms {

struct SandboxLimits {
  std::uint64_t memory_bytes = 0;  // that the child may take beyond what the parent has
  int seconds = 0;                 // of processor time; four times as long and 10 s more on the clock
};

// The child's end of the pipe to its parent.
class SandboxOutput {
 public:
  explicit SandboxOutput(int fd) : fd_(fd) {}
  void write(std::span<const std::uint8_t> bytes);

 private:
  const int fd_;
};

// The parent's. Throws when the child has ended or its time is over before all bytes were there.
class SandboxInput {
 public:
  SandboxInput(int fd, std::int64_t deadline_ms) : fd_(fd), deadline_ms_(deadline_ms) {}
  void read(std::span<std::uint8_t> bytes);

 private:
  const int fd_;
  const std::int64_t deadline_ms_;
};

// Forks, runs `work` in the child and `consume` in the parent. A call of `work` that throws, or a child that dies,
// is an Error(kVerification) here that says how: its message, the signal, the limit or the refused system call. Throws
// Error(kFailed) when there can be no child, or what `consume` throws. What `consume` reads is the child's word: check
// it. No other thread may be inside a lock that `work` takes (malloc's are safe). Thread-safe.
void run_sandboxed(const SandboxLimits& limits, const std::function<void(SandboxOutput&)>& work,
                   const std::function<void(SandboxInput&)>& consume);

}  // namespace btms
