// HDF5 files in memory. A file is built or parsed as a byte image, so that all disk access is plain write/pread with
// plain error codes: a full disk never meets a half-closed HDF5 file (which crashes the library at exit), and bytes are
// hashed before HDF5 sees them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/store/hdf5_handle.h"

namespace btms {

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
