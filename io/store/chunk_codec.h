// The bytes of one HDF5 chunk, made and read without the HDF5 library: byte shuffle, zlib stream, Fletcher-32, exactly
// as its stock filters would write them, but in the calling thread and outside of the library's lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "io/files/deflate.h"

struct inflate_state;

namespace btms {

// HDF5's variant of Fletcher-32 (16-bit big-endian words).
std::uint32_t fletcher32(std::span<const std::uint8_t> bytes);

// Whether the bytes end with their own Fletcher-32, as those of a stored chunk do.
bool has_checksum(std::span<const std::uint8_t> stored);

// Holds the compressor's state; use one per thread at a time. Bytes depend on the version of ISA-L, values don't.
class ChunkEncoder {
 public:
  std::vector<std::uint8_t> encode(std::span<const std::uint8_t> values, std::size_t element_bytes);

 private:
  Deflater deflater_{Wrapper::kZlib};
  std::vector<std::uint8_t> shuffled_, deflated_;  // kept between calls
};

class ChunkDecoder {
 public:
  ChunkDecoder();
  ~ChunkDecoder();
  ChunkDecoder(const ChunkDecoder&) = delete;
  ChunkDecoder& operator=(const ChunkDecoder&) = delete;
  // False when the bytes are not a chunk of exactly values.size() bytes.
  bool decode(std::span<const std::uint8_t> stored, std::size_t element_bytes, std::span<std::uint8_t> values);

 private:
  std::unique_ptr<inflate_state> state_;
  std::vector<std::uint8_t> shuffled_;
};

}  // namespace btms
