// The memory budget: keeps what was used last in memory, and parks the rest on disk.
//
// Passes hold what they work on pinned (a tile and its strips, a bin); everything else may be parked at any time.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <list>
#include <mutex>
#include <utility>

#include "engine/tiling/spill.h"

namespace btms {

inline constexpr std::uint64_t kUnlimited_bytes = UINT64_MAX;

// Thread-safe. The budget is soft: what is pinned at a time stays in memory whatever its size.
class Pager {
 public:
  // Something that can be parked. The pager outlives it.
  class Item {
   public:
    virtual ~Item() = default;

   private:
    friend class Pager;
    virtual std::uint64_t bytes() = 0;                  // held in memory now
    virtual void park(Spill& spill, bool changed) = 0;  // writes it unless the disk has it already, frees the memory
    virtual void restore(const Spill& spill) = 0;

    std::uint64_t counted_ = 0;
    int pins_ = 0;
    bool parked_ = false, moving_ = false, changed_ = false, idle_ = false;
    std::list<Item*> node_{this};  // in idle_items_ where idle_, at at_: to move it there allocates nothing
    std::list<Item*>::iterator at_;
  };

  Pager(std::uint64_t budget_bytes, std::filesystem::path spill_folder)
      : budget_(budget_bytes), spill_(std::move(spill_folder)) {}

  // Between pin and unpin the item is in memory and stays there. pin throws what the disk said, also when something
  // else could not be parked before: nothing is lost by that, but the budget can't be kept.
  void pin(Item& item);
  void unpin(Item& item, bool changed) noexcept;
  // The item is about to go. Precondition: not pinned.
  void forget(Item& item);

  // Memory that is counted but can't be parked. False (and nothing is counted) where it would break the budget.
  bool claim(std::uint64_t bytes);
  void release(std::uint64_t bytes);
  // The same for what has to be in memory: other things make room for it.
  class Claim {
   public:
    Claim(Pager& pager, std::uint64_t bytes) : pager_(pager), bytes_(bytes) { pager_.take(bytes_); }
    ~Claim() { pager_.release(bytes_); }
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;

   private:
    Pager& pager_;
    const std::uint64_t bytes_;
  };

  Spill& spill() { return spill_; }
  bool limited() const { return budget_ != kUnlimited_bytes; }
  // Alternates between walks over everything: true for every other.
  bool turn() {
    const std::lock_guard lock(mutex_);
    return backwards_ = !backwards_;
  }
  std::uint64_t peak_bytes() {
    const std::lock_guard lock(mutex_);
    return peak_;
  }

 private:
  void take(std::uint64_t bytes) noexcept;
  void count(Item& item);
  void set_idle(Item& item, bool idle) noexcept;
  void make_room(std::unique_lock<std::mutex>& lock) noexcept;
  // What is free inside its heap the allocator gives back only when asked, and asking takes time.
  void trim(std::unique_lock<std::mutex>& lock) noexcept;

  const std::uint64_t budget_;
  Spill spill_;
  std::mutex mutex_;  // guards what follows and the private members of items; never held while the disk works
  std::condition_variable moved_;
  std::list<Item*> idle_items_;  // in memory and not pinned, the longest unused first
  std::uint64_t held_ = 0, peak_ = 0;
  std::uint64_t freed_ = 0;  // since the allocator has last given back what it has free
  bool backwards_ = true;
  std::exception_ptr failure_;  // of parking
};

}  // namespace btms
