// Fuzz targets: functions that take any bytes through a reader and throw nothing.
//
// A target reads all there is to read, and checks what the reader promises; a broken promise, or an exception other
// than the Error that a damaged file deserves, leaves it as an exception. libFuzzer calls a target with clang
// (one_input.cpp), the ordinary tests call it with the kept files (replay_test.cpp). Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/error.h"

namespace btms::fuzz {

using Bytes = std::span<const std::uint8_t>;

struct Target {
  const char* name;
  void (*run)(Bytes);
};
std::span<const Target> targets();

class BrokenPromise : public std::logic_error {
  using std::logic_error::logic_error;
};
inline void require(bool promise, const char* what) {
  if (!promise) throw BrokenPromise(what);
}

// Calls fn; true when it threw no Error. Bytes are to blame for an Error(kBadInput) or the others a caller allows;
// never for kFailed: that is how a failing system looks.
template <class Fn>
bool accepted(Fn&& fn, std::initializer_list<ErrorCode> refusals = {ErrorCode::kBadInput}) {
  try {
    fn();
    return true;
  } catch (const Error& error) {
    for (const ErrorCode code : refusals)
      if (error.code() == code) return false;
    throw BrokenPromise(std::string("refused as ") + error_name(error.code()) + ": " + error.what());
  }
}

// The bytes as a file in memory, whose path ends in `extension` (".las"). Valid until the next call with the same one.
std::filesystem::path file_of(Bytes bytes, const std::string& extension);
// A folder in memory where there is such a file system, removed at the end.
const std::filesystem::path& folder();
std::vector<std::uint8_t> content(const std::filesystem::path& file);

// Numbers from the front of an input that steer a target. 0 when there are none left.
class Front {
 public:
  explicit Front(Bytes bytes) : rest_(bytes) {}
  std::uint8_t byte();
  std::uint16_t word() { return static_cast<std::uint16_t>(byte() | byte() << 8); }
  Bytes take(std::size_t n);  // or as many as there are
  Bytes rest() const { return rest_; }

 private:
  Bytes rest_;
};

// points.cpp
void las(Bytes);
void pcd(Bytes);
void ply(Bytes);
void xyz(Bytes);
void npy(Bytes);
void kitti(Bytes);
// lzf.cpp
void lzf(Bytes);
// texts.cpp
void poses(Bytes);
void config(Bytes);
void crs(Bytes);
// eval.cpp
void labels(Bytes);
// store.cpp
void manifest(Bytes);
void chunk(Bytes);
void layers(Bytes);
void journal(Bytes);
void rounds(Bytes);

// request.cpp
void request(Bytes);

}  // namespace btms::fuzz
