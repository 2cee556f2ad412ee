// A list of values, one a tile or a bin, of which only those in use need be in memory.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/tiling/pager.h"

namespace btms {

// What a pass does to an element while it runs.
class PagedList {
 public:
  virtual ~PagedList() = default;
  virtual void pin(std::size_t i) const = 0;
  virtual void unpin(std::size_t i, bool changed) const noexcept = 0;
};
struct Use {
  const PagedList* list = nullptr;  // nullptr: nothing
  bool changes = false;
};

// Element i of several lists, in use until the end of the scope.
class InUse {
 public:
  InUse(const std::vector<Use>& uses, std::size_t i) : i_(i) {
    uses_.reserve(uses.size());
    try {
      for (const Use& use : uses) {
        if (!use.list) continue;
        use.list->pin(i);
        uses_.push_back(use);
      }
    } catch (...) {
      let_go();
      throw;
    }
  }
  ~InUse() { let_go(); }
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;

 private:
  void let_go() {
    for (const Use& use : uses_) use.list->unpin(i_, use.changes);
  }
  std::size_t i_;
  std::vector<Use> uses_;  // pinned
};

// T is a vector of trivially copyable elements, or holds its bulk in such vectors, shown by T::for_each_buffer(fn); the
// rest of it is small and stays in memory. Thread-safe as far as T is: whoever edits an element is the only one to
// touch that part of it.
template <class T>
class Paged final : public PagedList {
  template <class Fn>
  static void for_each_buffer(T& value, const Fn& fn) {
    if constexpr (requires { value.for_each_buffer(fn); })
      value.for_each_buffer(fn);
    else
      fn(value);
  }

  struct Slot final : Pager::Item {
    T value;

    std::uint64_t bytes() override {
      std::uint64_t sum = 0;
      for_each_buffer(value, [&](const auto& buffer) { sum += buffer.capacity() * sizeof(buffer[0]); });
      return sum;
    }
    void park(Spill& spill, bool changed) override {
      changed |= sizes.empty();
      if (changed) {
        const std::uint64_t needed = bytes();
        if (extent.size < needed) {
          spill.discard(extent);
          extent = spill.reserve(needed);
        }
        sizes.clear();
        // All of it is on disk before any of it is freed: when the disk is full, the element is still whole.
        std::vector<std::size_t> written;
        std::uint64_t at = extent.offset;
        for_each_buffer(value, [&](auto& buffer) {
          spill.write(at, {reinterpret_cast<const std::uint8_t*>(buffer.data()), raw_size(buffer)});
          written.push_back(buffer.size());
          at += raw_size(buffer);
        });
        sizes = std::move(written);
      }
      for_each_buffer(value, [](auto& buffer) { std::remove_reference_t<decltype(buffer)>().swap(buffer); });
    }
    void restore(const Spill& spill) override {
      std::uint64_t at = extent.offset;
      std::size_t k = 0;
      for_each_buffer(value, [&](auto& buffer) {
        buffer.resize(sizes[k++]);
        spill.read(at, {reinterpret_cast<std::uint8_t*>(buffer.data()), raw_size(buffer)});
        at += raw_size(buffer);
      });
    }
    template <class E>
    static std::size_t raw_size(const std::vector<E>& buffer) {
      static_assert(std::is_trivially_copyable_v<E>);
      return buffer.size() * sizeof(E);
    }

    Spill::Extent extent;
    std::vector<std::size_t> sizes;  // of the buffers as the disk has them; empty: it hasn't
  };

 public:
  // An element while it is in use, like a pointer to it.
  template <class Value>
  class Lease {
   public:
    Lease(Pager& pager, Slot& slot) : pager_(&pager), slot_(&slot) { pager.pin(slot); }
    ~Lease() {
      if (slot_) pager_->unpin(*slot_, !std::is_const_v<Value>);
    }
    Lease(Lease&& o) noexcept : pager_(o.pager_), slot_(std::exchange(o.slot_, nullptr)) {}
    Lease& operator=(Lease&&) = delete;

    Value& operator*() const { return slot_->value; }
    Value* operator->() const { return &slot_->value; }

   private:
    Pager* pager_;
    Slot* slot_;
  };

  Paged() = default;
  Paged(Pager& pager, std::size_t n) : pager_(&pager), slots_(n) {
    for (auto& slot : slots_) slot = std::make_unique<Slot>();
  }
  Paged(Paged&& o) noexcept : pager_(o.pager_), slots_(std::move(o.slots_)) { o.slots_.clear(); }
  Paged& operator=(Paged&& o) noexcept {
    clear();
    pager_ = o.pager_;
    slots_ = std::move(o.slots_);
    o.slots_.clear();
    return *this;
  }
  ~Paged() override { clear(); }

  std::size_t size() const { return slots_.size(); }
  Pager& pager() const { return *pager_; }
  // Precondition: in use.
  T& operator[](std::size_t i) { return slots_[i]->value; }
  const T& operator[](std::size_t i) const { return slots_[i]->value; }
  Lease<const T> view(std::size_t i) const { return {*pager_, *slots_[i]}; }
  Lease<T> edit(std::size_t i) { return {*pager_, *slots_[i]}; }
  // The element is gone; an empty one takes its place. Precondition: not in use.
  void drop(std::size_t i) {
    discard(*slots_[i]);
    slots_[i] = std::make_unique<Slot>();
  }

  void pin(std::size_t i) const override { pager_->pin(*slots_[i]); }
  void unpin(std::size_t i, bool changed) const noexcept override { pager_->unpin(*slots_[i], changed); }

 private:
  void discard(Slot& slot) {
    pager_->forget(slot);
    pager_->spill().discard(slot.extent);
  }
  void clear() {
    for (auto& slot : slots_) discard(*slot);
    slots_.clear();
  }

  Pager* pager_ = nullptr;
  std::vector<std::unique_ptr<Slot>> slots_;
};

template <class T>
Use reads(const Paged<T>& list) {
  return {&list, false};
}
template <class T>
Use writes(Paged<T>& list) {
  return {&list, true};
}

}  // namespace btms
