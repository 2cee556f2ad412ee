#include "engine/tiling/pager.h"

#include <malloc.h>

#include <algorithm>
#include <iterator>

namespace btms {
namespace {

constexpr std::uint64_t kTrim_bytes = std::uint64_t{16} << 20;

}  // namespace

void Pager::pin(Item& item) {
  std::unique_lock lock(mutex_);
  moved_.wait(lock, [&] { return !item.moving_; });
  if (failure_) std::rethrow_exception(failure_);
  ++item.pins_;
  set_idle(item, false);
  if (!item.parked_) return;
  item.moving_ = true;
  lock.unlock();
  try {
    item.restore(spill_);
  } catch (...) {
    lock.lock();
    item.moving_ = false;
    --item.pins_;
    moved_.notify_all();
    throw;
  }
  lock.lock();
  item.moving_ = item.parked_ = false;
  count(item);
  moved_.notify_all();
  make_room(lock);
}

void Pager::unpin(Item& item, bool changed) noexcept {
  std::unique_lock lock(mutex_);
  item.changed_ |= changed;
  if (--item.pins_ > 0) return;
  count(item);
  set_idle(item, true);
  make_room(lock);
}

void Pager::forget(Item& item) {
  std::unique_lock lock(mutex_);
  moved_.wait(lock, [&] { return !item.moving_; });
  set_idle(item, false);
  held_ -= item.counted_;
  freed_ += item.counted_;
  item.counted_ = 0;
}

bool Pager::claim(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (limited() && held_ + bytes > budget_) return false;
  held_ += bytes;
  peak_ = std::max(peak_, held_);
  return true;
}

void Pager::take(std::uint64_t bytes) noexcept {
  std::unique_lock lock(mutex_);
  held_ += bytes;
  peak_ = std::max(peak_, held_);
  make_room(lock);
}

void Pager::release(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  held_ -= bytes;
  freed_ += bytes;
}

void Pager::count(Item& item) {
  held_ -= item.counted_;
  item.counted_ = item.bytes();
  held_ += item.counted_;
  peak_ = std::max(peak_, held_);
}

void Pager::set_idle(Item& item, bool idle) noexcept {
  if (item.idle_ == idle) return;
  item.idle_ = idle;
  if (idle) {
    idle_items_.splice(idle_items_.end(), item.node_);
    item.at_ = std::prev(idle_items_.end());
  } else {
    item.node_.splice(item.node_.end(), idle_items_, item.at_);
  }
}

void Pager::make_room(std::unique_lock<std::mutex>& lock) noexcept {
  while (held_ > budget_ && !idle_items_.empty() && !failure_) {
    Item& item = *idle_items_.front();
    set_idle(item, false);
    item.moving_ = true;
    const bool changed = item.changed_;
    lock.unlock();
    try {
      item.park(spill_, changed);
    } catch (...) {
      lock.lock();
      item.moving_ = false;
      set_idle(item, true);
      moved_.notify_all();
      failure_ = std::current_exception();
      return;
    }
    lock.lock();
    item.moving_ = item.changed_ = false;
    item.parked_ = true;
    held_ -= item.counted_;
    freed_ += item.counted_;
    item.counted_ = 0;
    moved_.notify_all();
  }
  trim(lock);
}

void Pager::trim(std::unique_lock<std::mutex>& lock) noexcept {
  if (freed_ < kTrim_bytes || peak_ < budget_ / 4 * 3) return;
  freed_ = 0;
  lock.unlock();
  ::malloc_trim(0);
  lock.lock();
}

}  // namespace btms
