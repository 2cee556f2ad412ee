// Buffers that are reused between calls from any thread: fresh pages cost more than the work done in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace btms {

// Thread-safe. Holds as many buffers as were ever in use at once.
class BufferPool {
 public:
  // A buffer for the time of a scope; must not outlive its pool.
  class Lease {
   public:
    Lease(BufferPool& pool, std::vector<std::uint8_t> bytes) : pool_(pool), bytes_(std::move(bytes)) {}
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() { pool_.give_back(std::move(bytes_)); }
    std::span<std::uint8_t> bytes() { return bytes_; }

   private:
    BufferPool& pool_;
    std::vector<std::uint8_t> bytes_;
  };

  // At least `size` bytes, contents undefined.
  Lease take(std::size_t size) {
    std::vector<std::uint8_t> bytes;
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        bytes = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (bytes.size() < size) bytes.resize(size);
    return {*this, std::move(bytes)};
  }

 private:
  // Never throws: where there is no memory to remember the buffer, it is freed.
  void give_back(std::vector<std::uint8_t> bytes) noexcept {
    const std::lock_guard lock(mutex_);
    try {
      free_.push_back(std::move(bytes));
    } catch (const std::bad_alloc&) {
    }
  }

  std::mutex mutex_;  // guards free_
  std::vector<std::vector<std::uint8_t>> free_;
};

}  // namespace btms
