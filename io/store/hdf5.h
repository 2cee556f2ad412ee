// HDF5 identifiers that own, one place where return codes become Error(kFailed), and HDF5 files in memory.
//
// A file is built or parsed as a byte image, so that all disk access is plain write/pread with plain error codes: a
// full disk never meets a half-closed HDF5 file (which crashes the library at exit), and bytes are hashed before HDF5
// sees them.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/error.h"

#ifndef H5_HAVE_THREADSAFE
#error "io/store calls HDF5 from several threads and relies on the library's own lock: use a thread-safe HDF5"
#endif

namespace btms {

// The innermost message of this thread's HDF5 error stack; clears it.
std::string hdf5_message();

template <class Code>
Code hdf5_check(Code code, const char* what) {
  if (code < 0) throw Error(ErrorCode::kFailed, std::string("HDF5 could not ") + what + ": " + hdf5_message());
  return code;
}

// HDF5 doesn't survive that it gets no memory: it follows null pointers, recurses, or ends the program. Better that
// this fails before, with std::bad_alloc; what it has freed, the allocator keeps for what follows.
void require_hdf5_memory();

// Asks for its memory, then keeps HDF5 from printing: its error stack in this thread, since errors travel as
// exceptions, and at the end of the program what a damaged file has left open inside the library.
class QuietHdf5 {
 public:
  QuietHdf5() {
    require_hdf5_memory();
    static const herr_t once = H5dont_atexit();
    static_cast<void>(once);
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

// close() is the normal end and reports failure; the destructor only cleans up after an exception.
template <herr_t (*CloseFn)(hid_t)>
class Hdf5Handle {
 public:
  Hdf5Handle() = default;
  Hdf5Handle(hid_t id, const char* what) : id_(hdf5_check(id, what)) {}
  Hdf5Handle(Hdf5Handle&& o) noexcept : id_(std::exchange(o.id_, -1)) {}
  Hdf5Handle& operator=(Hdf5Handle&& o) noexcept {
    std::swap(id_, o.id_);
    return *this;
  }
  ~Hdf5Handle() {
    if (id_ >= 0) CloseFn(id_);
  }
  hid_t get() const { return id_; }
  void close() {
    if (id_ >= 0) hdf5_check(CloseFn(std::exchange(id_, -1)), "close an object");
  }

 private:
  hid_t id_ = -1;
};

using Hdf5File = Hdf5Handle<H5Fclose>;
using Hdf5Group = Hdf5Handle<H5Gclose>;
using Hdf5Dataset = Hdf5Handle<H5Dclose>;
using Hdf5Attribute = Hdf5Handle<H5Aclose>;
using Hdf5Space = Hdf5Handle<H5Sclose>;
using Hdf5Type = Hdf5Handle<H5Tclose>;
using Hdf5Properties = Hdf5Handle<H5Pclose>;

// An HDF5 file under construction. Not thread-safe.
class Hdf5Image {
 public:
  Hdf5Image();
  ~Hdf5Image();
  Hdf5Image(const Hdf5Image&) = delete;
  Hdf5Image& operator=(const Hdf5Image&) = delete;

  hid_t file() const { return file_.get(); }
  // Closes the file and returns its bytes. Every other handle into it must have been closed.
  std::vector<std::uint8_t> finish();

 private:
  struct Memory;
  static H5FD_file_image_callbacks_t callbacks(Memory* memory);

  Memory* memory_;
  Hdf5File file_;
};

// Opens a copy of `bytes` read-only.
Hdf5File open_image(std::span<const std::uint8_t> bytes);

}  // namespace btms
