// Reads records of equal length in blocks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/tiling/millimetres.h"
#include "io/points/input_file.h"

namespace btms {

struct RecordLayout {
  std::uint64_t offset;  // of record 0 in the file
  std::size_t stride;
};

// Calls visit(bytes of n records, n, index of their first counted from `first`) with up to kMmChunk records at a time.
// `buffer` is reused between calls.
template <class Visit>
void read_records(const InputFile& file, const RecordLayout& layout, std::uint64_t first, std::size_t count,
                  std::vector<std::uint8_t>& buffer, Visit&& visit) {
  // Per pread: small enough to be still in the second-level cache when they are unpacked.
  constexpr std::size_t kReadBytes = std::size_t{1} << 18;
  const std::size_t stride = layout.stride, most = std::max<std::size_t>(1, kReadBytes / stride);
  const InputFile::Session session = file.open();
  for (std::size_t done = 0; done < count;) {
    const std::size_t n = std::min(most, count - done);
    if (buffer.size() < n * stride) buffer.resize(n * stride);
    session.read(layout.offset + (first + done) * stride, {buffer.data(), n * stride});
    for (std::size_t i = 0; i < n; i += kMmChunk)
      visit(buffer.data() + i * stride, std::min(kMmChunk, n - i), done + i);
    done += n;
  }
  session.finish();
}

}  // namespace btms
