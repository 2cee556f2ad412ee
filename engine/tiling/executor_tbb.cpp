#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <exception>
#include <latch>
#include <string>
#include <thread>
#include <vector>

#include "engine/error.h"
#include "engine/tiling/executor.h"

namespace btms {
namespace {

class TbbThreads final : public Threads {
 public:
  explicit TbbThreads(int count)
      : limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)), arena_(count) {}

  int count() const override { return arena_.max_concurrency(); }

  void for_each(std::size_t n, const std::function<void(std::size_t, int)>& body) const override {
    arena_.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<std::size_t>(0, n, 1),
          [&](const tbb::blocked_range<std::size_t>& range) {
            const int worker = tbb::this_task_arena::current_thread_index();
            for (std::size_t i = range.begin(); i < range.end(); ++i) body(i, worker);
          },
          tbb::simple_partitioner());
    });
  }

 private:
  tbb::global_control limit_;  // also lets an arena be wider than the machine, for tests
  mutable tbb::task_arena arena_;
};

// TBB doesn't survive that a thread of its own can't be started: it hangs or ends the program.
void require_threads(int count) {
  std::latch started(1);  // all live at a time, as TBB's will
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(count));
  bool failed = false;
  for (int i = 1; i < count && !failed; ++i) {
    try {
      threads.emplace_back([&] { started.wait(); });
    } catch (const std::exception&) {
      failed = true;
    }
  }
  started.count_down();
  for (std::thread& thread : threads) thread.join();
  if (failed)
    throw Error(ErrorCode::kFailed, std::to_string(count) +
                                        " threads could not be started: use fewer (-j), allow more memory (ulimit -v) "
                                        "or more processes (ulimit -u)");
}

}  // namespace

std::unique_ptr<Threads> tbb_threads(int count) {
  require_threads(count);
  return std::make_unique<TbbThreads>(count);
}

}  // namespace btms
