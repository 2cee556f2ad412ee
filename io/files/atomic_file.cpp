#include "io/files/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include "engine/error.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = ".btms-", kSuffix = ".tmp";
constexpr int kMostAttempts = 100'000;

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : "."; }

// The name by which linkat() finds an open file that has none.
std::string descriptor_name(int fd) { return "/proc/self/fd/" + std::to_string(fd); }

// Once a process and folder: rests of killed runs are rare, listing a folder for each of a thousand files is not free.
void tidy_once(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<std::string> seen;
  {
    const std::lock_guard lock(mutex);
    if (!seen.insert(folder.string()).second) return;
  }
  remove_stale_temporaries(folder);
}

}  // namespace

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
  tidy_once(folder_of(path_));
  if (!open_unnamed()) open_named();
}

AtomicFile AtomicFile::written(fs::path path, std::span<const std::uint8_t> bytes) {
  AtomicFile file(std::move(path));
  file.write(0, bytes);
  file.check(bytes);
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& o) noexcept
    : path_(std::move(o.path_)),
      temporary_(std::move(o.temporary_)),
      fd_(std::move(o.fd_)),
      synced_(std::exchange(o.synced_, false)) {
  o.temporary_.clear();
}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::fail(int error, const char* doing) const {
  throw Error(ErrorCode::kFailed, std::string("cannot ") + doing + " it: " + system_reason(error), path_.string());
}

// A short name of its own: the final name with a suffix could exceed what the file system allows.
fs::path AtomicFile::temporary_name(int attempt) const {
  std::string name(kPrefix);
  name.append(std::to_string(::getpid())).append("-").append(std::to_string(attempt)).append(kSuffix);
  return folder_of(path_) / name;
}

bool AtomicFile::open_unnamed() {
  Descriptor fd(::open(folder_of(path_).c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666));
  // Without /proc the file could never get its name.
  if (fd.get() < 0 || ::access(descriptor_name(fd.get()).c_str(), F_OK) != 0) return false;
  ::flock(fd.get(), LOCK_EX);  // for the moment in which it has a temporary name; nobody else can hold it
  fd_ = std::move(fd);
  return true;
}

void AtomicFile::open_named() {
  for (int attempt = 0; fd_.get() < 0; ++attempt) {
    const fs::path name = temporary_name(attempt);
    Descriptor fd(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (fd.get() < 0) {
      if (errno != EEXIST || attempt == kMostAttempts) fail(errno, "create a file for");
      continue;
    }
    struct stat info {};
    ::flock(fd.get(), LOCK_EX);
    // Before the lock it looked like the rest of a killed run to others.
    if (::fstat(fd.get(), &info) == 0 && info.st_nlink == 0 && attempt < kMostAttempts) continue;
    temporary_ = name;
    fd_ = std::move(fd);
  }
}

void AtomicFile::reserve(std::uint64_t bytes) {
  if (bytes == 0) return;
  const int error = ::posix_fallocate(fd_.get(), 0, static_cast<off_t>(bytes));
  // Not every file system can reserve; the write will tell then.
  if (error != 0 && error != EOPNOTSUPP && error != EINVAL) fail(error, "reserve space for");
}

void AtomicFile::write(std::uint64_t offset, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) fail(put < 0 ? errno : EIO, "write");
    offset += static_cast<std::uint64_t>(put);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
}

void AtomicFile::start_writing(std::uint64_t offset, std::uint64_t bytes) const {
  // Only a head start; sync() decides, and reports what goes wrong.
  ::sync_file_range(fd_.get(), static_cast<off_t>(offset), static_cast<off_t>(bytes), SYNC_FILE_RANGE_WRITE);
}

void AtomicFile::check(std::span<const std::uint8_t> bytes) const {
  struct stat info {};
  if (::fstat(fd_.get(), &info) != 0) fail(errno, "check");
  bool equal = static_cast<std::uint64_t>(info.st_size) == bytes.size();
  std::vector<std::uint8_t> back(std::min<std::size_t>(bytes.size(), std::size_t{1} << 20));
  for (std::size_t done = 0; equal && done < bytes.size();) {
    const std::size_t most = std::min(back.size(), bytes.size() - done);
    const ssize_t got = ::pread(fd_.get(), back.data(), most, static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(errno, "read back");
    equal = got > 0 && std::memcmp(back.data(), bytes.data() + done, static_cast<std::size_t>(got)) == 0;
    done += static_cast<std::size_t>(got);
  }
  if (!equal) throw Error(ErrorCode::kFailed, "reads back differently from what was written", path_.string());
  start_writing(0, bytes.size());
}

void AtomicFile::sync() {
  if (!synced_ && ::fsync(fd_.get()) != 0) fail(errno, "sync");
  synced_ = true;
}

// Gives an unnamed file a name: its own when that is free, else a temporary one.
void AtomicFile::link_name() {
  const std::string self = descriptor_name(fd_.get());
  const auto link_as = [&](const fs::path& name) {
    return ::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
  };
  if (link_as(path_)) return;
  for (int attempt = 0; temporary_.empty(); ++attempt) {
    if (errno != EEXIST || attempt == kMostAttempts) fail(errno, "name");
    const fs::path name = temporary_name(attempt);
    if (link_as(name)) temporary_ = name;
  }
}

void AtomicFile::place() {
  sync();
  if (temporary_.empty()) link_name();
  if (!temporary_.empty()) {
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno, "rename");
    temporary_.clear();
  }
  if (fd_.close() != 0) fail(errno, "close");
}

void AtomicFile::commit() {
  place();
  sync_folder(folder_of(path_));
}

void write_file(const fs::path& path, std::span<const std::uint8_t> bytes) {
  AtomicFile::written(path, bytes).commit();
}

void make_folders(const fs::path& folder) {
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) return;
  const fs::path parent = folder_of(folder);
  if (parent != folder && parent != ".") make_folders(parent);
  if (folder.filename().empty()) return;  // a/b/ is a/b
  if (::mkdir(folder.c_str(), 0777) == 0) return sync_folder(parent);
  const int error = errno;
  if (!fs::is_directory(folder, ignored))  // another rank was first
    throw Error(ErrorCode::kFailed, "cannot make the folder: " + system_reason(error), folder.string());
}

void write_file(const fs::path& path, std::string_view text) {
  write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void sync_folder(const fs::path& folder) {
  const auto fail = [&](const char* doing) {
    throw Error(ErrorCode::kFailed, std::string("cannot ") + doing + ": " + system_reason(errno), folder.string());
  };
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0) fail("open the folder");
  if (::fsync(fd.get()) != 0 && errno != EINVAL) fail("sync the folder");
}

bool is_temporary_name(const std::string& name) {
  const auto skip_digits = [](std::string_view text) {
    return text.substr(std::min(text.find_first_not_of("0123456789"), text.size()));
  };
  if (!name.starts_with(kPrefix)) return false;
  const std::string_view from_pid = std::string_view(name).substr(kPrefix.size()), dash = skip_digits(from_pid);
  if (dash.size() == from_pid.size() || !dash.starts_with('-')) return false;
  const std::string_view from_n = dash.substr(1), end = skip_digits(from_n);
  return end.size() != from_n.size() && end == kSuffix;
}

void remove_stale_temporaries(const fs::path& folder) {
  std::error_code ignored;
  for (fs::directory_iterator it(folder, ignored), end; !ignored && it != end; it.increment(ignored)) {
    if (!is_temporary_name(it->path().filename().string())) continue;
    const Descriptor fd(::open(it->path().c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC));
    struct stat info {};
    if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0 || !S_ISREG(info.st_mode)) continue;
    if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) ::unlink(it->path().c_str());
  }
}

}  // namespace btms
