#include "engine/tiling/spill.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <utility>

#include "engine/error.h"

namespace btms {
namespace {

constexpr std::size_t kMaxTransfer_bytes = std::size_t{1} << 30;

[[noreturn]] void fail(const std::string& what, const std::filesystem::path& folder) {
  const int error = errno;
  const bool full = error == ENOSPC || error == EDQUOT;
  throw Error(ErrorCode::kFailed,
              what + ": " +
                  (full ? "the disk is full; free some space, name another folder with --spill, or allow more --memory"
                        : system_reason(error)),
              folder.string());
}

// A file that has no name, or loses it at once.
int nameless_file(const std::filesystem::path& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) return file;
  std::string name = (folder / ".btms-spill-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

Spill::Spill(std::filesystem::path folder) : folder_(folder.empty() ? "." : std::move(folder)) {}

Spill::~Spill() {
  if (file_ >= 0) ::close(file_);
}

void Spill::open() {
  const std::lock_guard lock(opening_);
  if (file_ >= 0) return;
  const int file = nameless_file(folder_);
  if (file < 0) fail("no scratch file could be made", folder_);
  file_ = file;
}

Spill::Extent Spill::reserve(std::uint64_t bytes) {
  if (file_ < 0) open();
  return {end_.fetch_add(bytes), bytes};
}

void Spill::write(std::uint64_t offset, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t n =
        ::pwrite(file_, bytes.data(), std::min(bytes.size(), kMaxTransfer_bytes), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail("the scratch file could not be written", folder_);
    written_ += static_cast<std::uint64_t>(n);
    offset += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void Spill::read(std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n =
        ::pread(file_, bytes.data(), std::min(bytes.size(), kMaxTransfer_bytes), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = EIO;  // shorter than what was written
    if (n <= 0) fail("the scratch file could not be read", folder_);
    offset += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void Spill::discard(const Extent& extent) {
  // Only whole blocks are given back, and only where the file system can: it is no more than thrift.
  if (extent.size > 0)
    (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, static_cast<off_t>(extent.offset),
                      static_cast<off_t>(extent.size));
}

std::uint64_t free_disk_bytes(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::filesystem::path place = std::filesystem::absolute(folder, ignored);
  while (!place.empty() && place.has_parent_path() && place != place.parent_path() &&
         !std::filesystem::exists(place, ignored))
    place = place.parent_path();
  struct statvfs disk {};
  if (::statvfs(place.c_str(), &disk) != 0) return UINT64_MAX;
  return std::uint64_t{disk.f_bavail} * disk.f_frsize;
}

void require_disk(const std::filesystem::path& folder, std::uint64_t bytes, const std::string& advice) {
  const std::uint64_t free = free_disk_bytes(folder);
  if (bytes <= free) return;
  const auto megabytes = [](std::uint64_t b) { return std::to_string(b / 1'000'000) + " MB"; };
  throw Error(
      ErrorCode::kFailed,
      megabytes(bytes) + " are needed on this disk, " + megabytes(free) + " are free: free some space, " + advice,
      folder.string());
}

}  // namespace btms
