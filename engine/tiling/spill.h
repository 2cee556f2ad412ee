// Scratch space on disk for what the memory budget doesn't hold: one file without a name, so that nothing of it is left
// after a crash.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>

namespace btms {

// Thread-safe; nobody reads an extent while somebody writes or discards it.
class Spill {
 public:
  struct Extent {
    std::uint64_t offset = 0, size = 0;
  };

  // The file is made in `folder` by the first reserve().
  explicit Spill(std::filesystem::path folder);
  ~Spill();
  Spill(const Spill&) = delete;
  Spill& operator=(const Spill&) = delete;

  // Room for that many bytes. Throws Error(kFailed) when the file can't be made.
  Extent reserve(std::uint64_t bytes);
  // Both throw Error(kFailed), a full disk with what to do about it.
  void write(std::uint64_t offset, std::span<const std::uint8_t> bytes);
  void read(std::uint64_t offset, std::span<std::uint8_t> bytes) const;
  // The disk has its blocks back; the extent is gone.
  void discard(const Extent& extent);

  std::uint64_t bytes_written() const { return written_; }

 private:
  void open();

  const std::filesystem::path folder_;
  std::mutex opening_;
  std::atomic<int> file_{-1};
  std::atomic<std::uint64_t> end_{0}, written_{0};
};

// Bytes that can still be written in `folder` (or the nearest folder above that exists); UINT64_MAX when unknown.
std::uint64_t free_disk_bytes(const std::filesystem::path& folder);

// Throws Error(kFailed) when fewer are left, ending in what to do about it.
void require_disk(const std::filesystem::path& folder, std::uint64_t bytes, const std::string& advice);

}  // namespace btms
