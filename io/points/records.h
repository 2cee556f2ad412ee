// Reads records of equal length in blocks.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/tiling/millimetres.h"
#include "io/points/input_file.h"

namespace btms {

struct RecordLayout {
  std::uint64_t offset;  // of record 0 in the file
  std::size_t stride;
};

// Calls visit(bytes of n records, n, index of their first counted from `first`) with up to kMmChunk records at a time.
// Reads into block.bytes: all records where the block asks for them, else each lot over the one before.
template <class Visit>
void read_records(const InputFile& file, const RecordLayout& layout, std::uint64_t first, std::size_t count,
                  PointBlock& block, Visit&& visit) {
  // Per pread: small enough to be still in the second-level cache when they are unpacked.
  constexpr std::size_t kReadBytes = std::size_t{1} << 18;
  const std::size_t stride = layout.stride, most = std::max<std::size_t>(1, kReadBytes / stride);
  const InputFile::Session session = file.open();
  const std::size_t held = (block.keep_records ? count : std::min(most, count)) * stride;
  if (block.bytes.size() < held) block.bytes.resize(held);
  for (std::size_t done = 0; done < count;) {
    const std::size_t n = std::min(most, count - done);
    std::uint8_t* const records = block.bytes.data() + (block.keep_records ? done * stride : 0);
    session.read(layout.offset + (first + done) * stride, {records, n * stride});
    for (std::size_t i = 0; i < n; i += kMmChunk) visit(records + i * stride, std::min(kMmChunk, n - i), done + i);
    done += n;
  }
  session.finish();
}

}  // namespace btms
