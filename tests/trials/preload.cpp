// Preloaded into the program: lets the k-th call that changes files fail, and logs all of them.
//
//   BTMS_FAULTS_STATE=FILE  24 bytes, shared with forked ranks: how many calls the error can befall there were, how
//   many
//                           failed, and how many of these were an fsync, which nobody may pass over
//   BTMS_FAULTS_ERROR=NAME  ENOSPC, EIO, EMFILE (opening, also to read), SHORT (half is written), EINTR (of a write) or
//                           ENOMEM (operator new, from the first file opened on)
//   BTMS_FAULTS_AT=K        the K-th such call fails, from 1
//   BTMS_FAULTS_LASTING=1   and all that follow
//   BTMS_FAULTS_LOG=FILE    the calls that succeeded, as records of write_log.h
//   BTMS_LIMIT_AS, BTMS_LIMIT_FSIZE, BTMS_LIMIT_NOFILE=N  limits as of setrlimit(2); AS counts from what main() begins
//   with
//
// Only what the program and its libraries call through the dynamic linker is seen: the C library's own streams are not.
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "tests/trials/write_log.h"

namespace {

using btms::test::WriteOp;
using btms::test::WriteRecord;

struct State {
  std::atomic<std::uint64_t> calls, failed, syncs_failed;
};

State* state = nullptr;
std::uint64_t fail_at = 0;
bool lasting = false;
int error_number = 0;
enum class Kind { kNone, kDisk, kOpen, kWrite, kMemory } befalls = Kind::kNone;  // the calls the error can befall
bool cuts_short = false, out_of_memory = false, in_main = false;
int log_fd = -1;

std::uint64_t number(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : 0;
}

void limit(const char* name, __rlimit_resource resource, std::uint64_t above = 0) {
  if (!std::getenv(name)) return;
  const rlimit wanted{above + number(name), above + number(name)};
  ::setrlimit(resource, &wanted);
}

// Before anything else of the program runs, its static objects included.
__attribute__((constructor(101))) void start() {
  if (const char* file = std::getenv("BTMS_FAULTS_STATE")) {
    const int fd = static_cast<int>(::syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC));
    void* shared = ::mmap(nullptr, sizeof(State), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (shared != MAP_FAILED) state = static_cast<State*>(shared);
    ::syscall(SYS_close, fd);
  }
  if (const char* file = std::getenv("BTMS_FAULTS_LOG"))
    log_fd = static_cast<int>(
        ::syscall(SYS_openat, AT_FDCWD, file, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0600));
  fail_at = number("BTMS_FAULTS_AT");
  lasting = number("BTMS_FAULTS_LASTING") != 0;
  const char* name = std::getenv("BTMS_FAULTS_ERROR");
  const auto is = [name](const char* other) { return name && std::strcmp(name, other) == 0; };
  if (is("ENOSPC")) befalls = Kind::kDisk, error_number = ENOSPC;
  if (is("EIO")) befalls = Kind::kDisk, error_number = EIO;
  if (is("EMFILE")) befalls = Kind::kOpen, error_number = EMFILE;
  if (is("EINTR")) befalls = Kind::kWrite, error_number = EINTR;
  if (is("ENOMEM")) out_of_memory = true, error_number = ENOMEM;
  if (is("SHORT")) befalls = Kind::kWrite, cuts_short = true;
  limit("BTMS_LIMIT_FSIZE", RLIMIT_FSIZE);
  limit("BTMS_LIMIT_NOFILE", RLIMIT_NOFILE);
}

// Counts a call and says whether it is to fail.
bool fails() {
  if (!state) return false;
  const std::uint64_t k = ++state->calls;
  if (fail_at == 0 || (lasting ? k < fail_at : k != fail_at)) return false;
  ++state->failed;
  errno = error_number;
  return true;
}
// Of operator new and of the program itself: a malloc() of HDF5 that fails makes it recurse until the stack ends, or
// exit(), which nobody here can mend.
struct Range {
  std::uintptr_t begin, end;
};
Range may_fail[2] = {};  // libstdc++, the program
int find_ranges(dl_phdr_info* object, std::size_t, void*) {
  const bool program = object->dlpi_name[0] == '\0';
  if (!program && !std::strstr(object->dlpi_name, "libstdc++")) return 0;
  Range& range = may_fail[program];
  if (range.end != 0) return 0;  // the vDSO has no name either
  range.begin = UINTPTR_MAX;
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    if (object->dlpi_phdr[i].p_type != PT_LOAD) continue;
    const std::uintptr_t begin = object->dlpi_addr + object->dlpi_phdr[i].p_vaddr;
    range.begin = std::min(range.begin, begin);
    range.end = std::max(range.end, begin + object->dlpi_phdr[i].p_memsz);
  }
  return 0;
}

bool memory_fails(void* caller) {
  if (befalls != Kind::kMemory) return false;
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  return std::any_of(may_fail, may_fail + 2, [at](const Range& r) { return at >= r.begin && at < r.end; }) && fails();
}
bool disk_fails() { return befalls == Kind::kDisk && fails(); }

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}
#define NEXT(name) (next<decltype(::name)>(#name))

bool describe(int fd, struct stat& info) { return ::fstat(fd, &info) == 0; }
// Files and folders, neither pipes nor what the caller has redirected.
bool concerns(int fd) {
  struct stat info {};
  return fd > 2 && describe(fd, info) && (S_ISREG(info.st_mode) || S_ISDIR(info.st_mode));
}

void log(WriteOp op, std::uint64_t inode, std::uint64_t offset = 0, const char* path = "", const char* other = "",
         const void* data = nullptr, std::size_t size = 0) {
  if (log_fd < 0) return;
  const int kept = errno;
  WriteRecord record{};
  record.op = op;
  record.inode = inode;
  record.offset = offset;
  record.path_size = static_cast<std::uint32_t>(std::strlen(path));
  record.other_size = static_cast<std::uint32_t>(std::strlen(other));
  record.data_size = size;
  const iovec parts[] = {{&record, sizeof record},
                         {const_cast<char*>(path), record.path_size},
                         {const_cast<char*>(other), record.other_size},
                         {const_cast<void*>(data), size}};
  ::syscall(SYS_writev, log_fd, parts, 4);  // one call: whole records, also of several threads
  errno = kept;
}
void log_file(WriteOp op, int fd, std::uint64_t offset = 0, const void* data = nullptr, std::size_t size = 0) {
  struct stat info {};
  if (log_fd >= 0 && describe(fd, info)) log(op, info.st_ino, offset, "", "", data, size);
}

// Opening: `call` does it. The first file opened ends the parsing of the command line, whose library doesn't survive
// that it gets no memory.
template <class Call>
int opened(const char* path, int flags, const Call& call) {
  if (out_of_memory && in_main) befalls = Kind::kMemory;
  const bool creates = (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
  if ((befalls == Kind::kOpen || (befalls == Kind::kDisk && creates)) && fails()) return -1;
  const bool existed = (flags & O_TMPFILE) != O_TMPFILE && ::access(path, F_OK) == 0;
  const int fd = call();
  if (fd >= 0 && creates && !existed) {
    struct stat info {};
    if (describe(fd, info)) log(WriteOp::kCreate, info.st_ino, 0, (flags & O_CREAT) != 0 ? path : "");
  }
  if (fd >= 0 && existed && (flags & O_TRUNC) != 0) log_file(WriteOp::kResize, fd, 0);
  return fd;
}

template <class Call>
ssize_t written(int fd, const void* data, std::size_t size, std::uint64_t offset, const Call& call) {
  if (!concerns(fd)) return call(size);
  if (befalls == Kind::kDisk || befalls == Kind::kWrite)
    if (fails()) {
      if (!cuts_short) return -1;
      size -= size / 2;
    }
  const ssize_t put = call(size);
  if (put > 0) log_file(WriteOp::kWrite, fd, offset, data, static_cast<std::size_t>(put));
  return put;
}

int synced(int fd, int (*call)(int)) {
  struct stat info {};
  if (!concerns(fd)) return call(fd);
  if (disk_fails()) {
    ++state->syncs_failed;
    return -1;
  }
  const int result = call(fd);
  if (result == 0 && describe(fd, info)) {
    char link[64], path[PATH_MAX] = "";
    std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    if (S_ISDIR(info.st_mode)) (void)!::readlink(link, path, sizeof path - 1);
    log(S_ISDIR(info.st_mode) ? WriteOp::kSyncFolder : WriteOp::kSync, info.st_ino, 0, path);
  }
  return result;
}

mode_t mode_of(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(arguments, unsigned)) : 0;
}

}  // namespace

#define OPEN(name)                                                             \
  int name(const char* path, int flags, ...) {                                 \
    va_list arguments;                                                         \
    va_start(arguments, flags);                                                \
    const mode_t mode = mode_of(flags, arguments);                             \
    va_end(arguments);                                                         \
    return opened(path, flags, [&] { return NEXT(name)(path, flags, mode); }); \
  }
#define OPENAT(name)                                                               \
  int name(int at, const char* path, int flags, ...) {                             \
    va_list arguments;                                                             \
    va_start(arguments, flags);                                                    \
    const mode_t mode = mode_of(flags, arguments);                                 \
    va_end(arguments);                                                             \
    return opened(path, flags, [&] { return NEXT(name)(at, path, flags, mode); }); \
  }
#define PWRITE(name)                                                                      \
  ssize_t name(int fd, const void* data, size_t size, off_t offset) {                     \
    return written(fd, data, size, static_cast<std::uint64_t>(offset),                    \
                   [&](std::size_t most) { return NEXT(name)(fd, data, most, offset); }); \
  }
#define MKOSTEMP(name)                                                            \
  int name(char* path, int flags) {                                               \
    if ((befalls == Kind::kDisk || befalls == Kind::kOpen) && fails()) return -1; \
    return NEXT(name)(path, flags);                                               \
  }
// posix_fallocate returns its error.
#define POSIX_FALLOCATE(name)                                                                 \
  int name(int fd, off_t offset, off_t size) {                                                \
    if (disk_fails()) return error_number;                                                    \
    const int result = NEXT(name)(fd, offset, size);                                          \
    if (result == 0) log_file(WriteOp::kGrow, fd, static_cast<std::uint64_t>(offset + size)); \
    return result;                                                                            \
  }
#define FALLOCATE(name)                                            \
  int name(int fd, int mode, off_t offset, off_t size) {           \
    return disk_fails() ? -1 : NEXT(name)(fd, mode, offset, size); \
  }
#define FTRUNCATE(name)                                                                \
  int name(int fd, off_t size) noexcept {                                              \
    if (disk_fails()) return -1;                                                       \
    const int result = NEXT(name)(fd, size);                                           \
    if (result == 0) log_file(WriteOp::kResize, fd, static_cast<std::uint64_t>(size)); \
    return result;                                                                     \
  }

extern "C" {

OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)
PWRITE(pwrite)
PWRITE(pwrite64)
MKOSTEMP(mkostemp)
MKOSTEMP(mkostemp64)
POSIX_FALLOCATE(posix_fallocate)
POSIX_FALLOCATE(posix_fallocate64)
FALLOCATE(fallocate)
FALLOCATE(fallocate64)
FTRUNCATE(ftruncate)
FTRUNCATE(ftruncate64)

ssize_t write(int fd, const void* data, size_t size) {
  const off_t at = log_fd >= 0 ? ::lseek(fd, 0, SEEK_CUR) : 0;
  return written(fd, data, size, static_cast<std::uint64_t>(at),
                 [&](std::size_t most) { return NEXT(write)(fd, data, most); });
}

int fsync(int fd) { return synced(fd, NEXT(fsync)); }
int fdatasync(int fd) { return synced(fd, NEXT(fdatasync)); }

int sync_file_range(int fd, off64_t offset, off64_t size, unsigned flags) {
  return disk_fails() ? -1 : NEXT(sync_file_range)(fd, offset, size, flags);
}

int close(int fd) {
  const bool counts =
      befalls == Kind::kDisk && fd > 2 && (::fcntl(fd, F_GETFL) & O_ACCMODE) != O_RDONLY && concerns(fd);
  const int result = NEXT(close)(fd);
  return counts && fails() ? -1 : result;
}

int rename(const char* from, const char* to) noexcept {
  if (disk_fails()) return -1;
  const int result = NEXT(rename)(from, to);
  if (result == 0) log(WriteOp::kRename, 0, 0, from, to);
  return result;
}

int linkat(int from_at, const char* from, int to_at, const char* to, int flags) noexcept {
  if (disk_fails()) return -1;
  const int result = NEXT(linkat)(from_at, from, to_at, to, flags);
  struct stat info {};
  if (result == 0 && ::stat(to, &info) == 0) log(WriteOp::kLink, info.st_ino, 0, to);
  return result;
}

int mkdir(const char* path, mode_t mode) noexcept {
  if (disk_fails()) return -1;
  const int result = NEXT(mkdir)(path, mode);
  if (result == 0) log(WriteOp::kMakeFolder, 0, 0, path);
  return result;
}

// What main() calls first: what failed before, in the start of some library, would be no fault of the program.
int mallopt(int parameter, int value) noexcept {
  static bool first = true;
  if (std::exchange(first, false)) {
    char text[64] = "";
    const int fd = static_cast<int>(::syscall(SYS_openat, AT_FDCWD, "/proc/self/statm", O_RDONLY | O_CLOEXEC));
    (void)!::syscall(SYS_read, fd, text, sizeof text - 1);
    ::syscall(SYS_close, fd);
    limit("BTMS_LIMIT_AS", RLIMIT_AS, std::strtoull(text, nullptr, 10) * static_cast<std::uint64_t>(::getpagesize()));
    if (out_of_memory) ::dl_iterate_phdr(find_ranges, nullptr);
    in_main = true;
  }
  return NEXT(mallopt)(parameter, value);
}

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  return memory_fails(__builtin_return_address(0)) ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) noexcept {
  return memory_fails(__builtin_return_address(0)) ? nullptr : __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  return memory_fails(__builtin_return_address(0)) ? nullptr : __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  return memory_fails(__builtin_return_address(0)) ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memory_fails(__builtin_return_address(0)) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** to, std::size_t alignment, std::size_t size) noexcept {
  void* memory = memory_fails(__builtin_return_address(0)) ? nullptr : __libc_memalign(alignment, size);
  if (!memory) return ENOMEM;
  *to = memory;
  return 0;
}

// Removing needs no space: it never fails here, so that the program can tidy up.
int unlink(const char* path) noexcept {
  const int result = NEXT(unlink)(path);
  if (result == 0) log(WriteOp::kRemove, 0, 0, path);
  return result;
}
int rmdir(const char* path) noexcept {
  const int result = NEXT(rmdir)(path);
  if (result == 0) log(WriteOp::kRemove, 0, 0, path);
  return result;
}
int remove(const char* path) noexcept {
  const int result = NEXT(remove)(path);
  if (result == 0) log(WriteOp::kRemove, 0, 0, path);
  return result;
}

}  // extern "C"
