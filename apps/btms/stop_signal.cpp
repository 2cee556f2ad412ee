#include "apps/btms/stop_signal.h"

#include <atomic>
#include <csignal>

#include "engine/error.h"

namespace btms {
namespace {

// The one mutable static of the program: a signal handler can reach nothing else.
std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void on_stop_signal(int) { stop_flag.store(true, std::memory_order_relaxed); }

}  // namespace

void watch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  action.sa_flags = SA_RESTART;  // a read or write under way goes on; the loop sees the flag after it
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool stop_signalled() { return stop_flag.load(std::memory_order_relaxed); }

void throw_if_stopped() {
  if (stop_signalled()) throw Error(ErrorCode::kCancelled, "stopped by the user");
}

}  // namespace btms
