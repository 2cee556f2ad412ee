// Who runs the tiles: threads inside a process, ranks beside it. Passes know of neither.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
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

// What a rank has handed to others.
struct Traffic {
  std::uint64_t sent_bytes = 0;    // to single ranks
  std::uint64_t shared_bytes = 0;  // to all of them, counted once
};

// The ranks of a run. Every rank executes the same program on its own tiles and calls exchange and share the same
// number of times, in the same order.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Sends out[r] to rank r for every r (itself included) and returns what each rank sent here, by rank.
  // Precondition: out.size() == size(). Throws Error(kFailed) when another rank has died.
  std::vector<Bytes> exchange(std::vector<Bytes> out) {
    for (std::size_t r = 0; r < out.size(); ++r)
      if (static_cast<int>(r) != rank()) traffic_.sent_bytes += out[r].size();
    return do_exchange(std::move(out));
  }
  // What every rank contributed, by rank; the same on all of them. Throws as exchange does.
  std::vector<Bytes> share(Bytes mine) {
    if (size() > 1) traffic_.shared_bytes += mine.size();
    return do_share(std::move(mine));
  }
  const Traffic& traffic() const { return traffic_; }  // so far

  // Whether the ranks run at the same time. Those that don't may begin at different levels (BuildOptions::memory).
  virtual bool in_step() const { return true; }
  // How much a rank had better say at once, of what it has much of.
  virtual std::uint64_t message_bytes() const { return std::uint64_t{4} << 20; }
  // Whether, of a level of `nodes` nodes, they rather tell each other all that is needed at once, though it grows with
  // the area, than ask each other again and again. The same on every rank.
  virtual bool tells_all(std::uint64_t nodes) const {
    (void)nodes;
    return false;
  }
  // What is exchanged from here on is about `topic`: who takes up a build in the middle counts the messages of a topic
  // as those do who were there from the beginning.
  virtual void enter(const std::string& topic) { (void)topic; }

  // The same list on every rank: what all ranks contributed, by rank.
  template <class T>
  std::vector<T> gather(std::vector<T> mine) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (size() == 1) return mine;
    Bytes bytes(mine.size() * sizeof(T));
    if (!mine.empty()) std::memcpy(bytes.data(), mine.data(), bytes.size());
    std::vector<T> all;
    for (const Bytes& in : share(std::move(bytes))) {
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
  // Every list becomes what all ranks contributed, by rank, at once. Collective.
  template <class... T>
  void pool(std::vector<T>&... lists) {
    static_assert((std::is_trivially_copyable_v<T> && ...));
    if (size() == 1) return;
    Bytes mine;
    const auto put = [&](auto& list) {
      const std::uint64_t n = list.size();
      const std::size_t at = mine.size(), bytes = list.size() * sizeof(list[0]);
      mine.resize(at + sizeof n + bytes);
      std::memcpy(mine.data() + at, &n, sizeof n);
      if (n > 0) std::memcpy(mine.data() + at + sizeof n, list.data(), bytes);
      list.clear();
    };
    (put(lists), ...);
    for (const Bytes& in : share(std::move(mine))) {
      const std::uint8_t* from = in.data();
      const auto take = [&](auto& list) {
        std::uint64_t n = 0;
        std::memcpy(&n, from, sizeof n);
        const std::size_t at = list.size(), bytes = n * sizeof(list[0]);
        list.resize(at + n);
        if (n > 0) std::memcpy(list.data() + at, from + sizeof n, bytes);
        from += sizeof n + bytes;
      };
      (take(lists), ...);
    }
  }

 private:
  virtual std::vector<Bytes> do_exchange(std::vector<Bytes> out) = 0;
  virtual std::vector<Bytes> do_share(Bytes mine) {
    return do_exchange(std::vector<Bytes>(static_cast<std::size_t>(size()), mine));
  }
  Traffic traffic_;
};

// The only rank of a run of one.
std::unique_ptr<Ranks> single_rank();

// Forks n - 1 processes and runs body(ranks) in every one of them; the calling process is rank 0. The ranks exchange
// really serialised bytes over socket pairs and share nothing else. Returns when all have ended. When one failed,
// throws its Error (of several, that of the lowest rank that did not merely notice another's end). Call before any
// thread has been started. Precondition: n >= 1.
void run_forked_ranks(int n, const std::function<void(Ranks&)>& body);

}  // namespace btms
