// A file that appears under its name only when it is complete. Every file the engine writes is one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "io/files/descriptor.h"

namespace btms {

// Until place() the file has no name at all where the file system can do that (O_TMPFILE), so nothing is left of a
// process that is killed; elsewhere it has a temporary name, which the next AtomicFile in that folder removes.
// write() is thread-safe for disjoint ranges. Every failure is an Error(kFailed) that names the final path. Without
// place() a file of that name, if there was one, is untouched.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  // With all of its bytes, written and read back, but not durable yet.
  static AtomicFile written(std::filesystem::path path, std::span<const std::uint8_t> bytes);
  AtomicFile(AtomicFile&& o) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  const std::filesystem::path& path() const { return path_; }
  // Takes the disk space now, so that a full disk shows before the work and not after it.
  void reserve(std::uint64_t bytes);
  void write(std::uint64_t offset, std::span<const std::uint8_t> bytes);
  // Asks the disk to start on what has been written there, so that sync() finds less to wait for. Thread-safe.
  void start_writing(std::uint64_t offset, std::uint64_t bytes) const;
  // Reads the file back and fails unless it is `bytes`; asks the disk to start writing.
  void check(std::span<const std::uint8_t> bytes) const;
  // The content is on disk.
  void sync();
  // sync(), then the file takes its name; durable after sync_folder(). Committing several files this way costs one
  // flush of the folder instead of one a file.
  void place();
  // place() and sync_folder().
  void commit();

 private:
  [[noreturn]] void fail(int error, const char* doing) const;
  std::filesystem::path temporary_name(int attempt) const;
  bool open_unnamed();
  void open_named();
  void link_name();

  std::filesystem::path path_, temporary_;  // temporary_ is empty while the file has no name
  Descriptor fd_;
  bool synced_ = false;
};

// All of a file at once, checked and committed.
void write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
void write_file(const std::filesystem::path& path, std::string_view text);

// Makes `folder`, and those above it that don't exist, with durable names. Throws Error(kFailed).
void make_folders(const std::filesystem::path& folder);

// Makes names in `folder` durable. Throws Error(kFailed).
void sync_folder(const std::filesystem::path& folder);

// Whether `name` is one that an AtomicFile may have for a time: .btms-PID-N.tmp
bool is_temporary_name(const std::string& name);

// Removes temporary files whose writers are gone: a living one holds a lock on its file. Failures are ignored.
void remove_stale_temporaries(const std::filesystem::path& folder);

}  // namespace btms
