// Who runs the tiles: threads inside a process, ranks beside it. Passes know of neither.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

namespace btms {

// Runs independent pieces of work. Exceptions of a piece reach the caller of for_each once every running piece ended.
class Threads {
 public:
  virtual ~Threads() = default;
  virtual int count() const = 0;
  // Calls body(i, worker) for every i in [0, n), each once, in any order; worker is in [0, count()) and no two calls
  // run at the same time with the same worker, so scratch memory is kept per worker.
  virtual void for_each(std::size_t n, const std::function<void(std::size_t, int)>& body) const = 0;
};

std::unique_ptr<Threads> serial_threads();
// oneTBB, one task per piece. Nothing is started before the first for_each.
std::unique_ptr<Threads> tbb_threads(int count);

using Bytes = std::vector<std::uint8_t>;

// The ranks of a run. Every rank executes the same program on its own tiles and calls exchange the same number of
// times.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Sends out[r] to rank r for every r (itself included) and returns what each rank sent here, by rank.
  // Precondition: out.size() == size(). Throws Error(kFailed) when another rank has died.
  virtual std::vector<Bytes> exchange(std::vector<Bytes> out) = 0;

  // The same list on every rank: what all ranks contributed, by rank.
  template <class T>
  std::vector<T> gather(std::vector<T> mine) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (size() == 1) return mine;
    Bytes bytes(mine.size() * sizeof(T));
    if (!mine.empty()) std::memcpy(bytes.data(), mine.data(), bytes.size());
    std::vector<T> all;
    for (const Bytes& in : exchange(std::vector<Bytes>(static_cast<std::size_t>(size()), bytes))) {
      const std::size_t at = all.size();
      all.resize(at + in.size() / sizeof(T));
      if (!in.empty()) std::memcpy(all.data() + at, in.data(), in.size());
    }
    return all;
  }
  // Element by element, the sum over all ranks. Precondition: the same number of elements on every rank.
  template <class T>
  std::vector<T> sum(const std::vector<T>& mine) {
    const std::vector<T> all = gather(mine);
    std::vector<T> sums(mine.size());
    for (std::size_t i = 0; i < all.size(); ++i) sums[i % mine.size()] += all[i];
    return sums;
  }
};

// The only rank of a run of one.
std::unique_ptr<Ranks> single_rank();

// Forks n - 1 processes and runs body(ranks) in every one of them; the calling process is rank 0. The ranks exchange
// really serialised bytes over socket pairs and share nothing else. Returns when all have ended. When one failed,
// throws its Error (of several, that of the lowest rank that did not merely notice another's end). Call before any
// thread has been started. Precondition: n >= 1.
void run_forked_ranks(int n, const std::function<void(Ranks&)>& body);

}  // namespace btms
