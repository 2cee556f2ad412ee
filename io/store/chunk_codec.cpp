#include "io/store/chunk_codec.h"

#include <libdeflate.h>

#include <cstring>

#include "engine/error.h"

namespace btms {
namespace {

constexpr std::size_t kChecksum_bytes = 4;

// The element size is a constant in the loops, else the compiler can't vectorise them.
template <std::size_t kBytes>
void shuffle_elements(const std::uint8_t* in, std::size_t n, std::uint8_t* out) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t byte = 0; byte < kBytes; ++byte) out[byte * n + i] = in[i * kBytes + byte];
}
template <std::size_t kBytes>
void unshuffle_elements(const std::uint8_t* in, std::size_t n, std::uint8_t* out) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t byte = 0; byte < kBytes; ++byte) out[i * kBytes + byte] = in[byte * n + i];
}

// Elements have 2 or 4 bytes; single bytes are not shuffled.
void shuffle(std::span<const std::uint8_t> in, std::size_t element_bytes, std::uint8_t* out) {
  if (element_bytes == 2) return shuffle_elements<2>(in.data(), in.size() / 2, out);
  shuffle_elements<4>(in.data(), in.size() / 4, out);
}
void unshuffle(const std::uint8_t* in, std::size_t element_bytes, std::span<std::uint8_t> out) {
  if (element_bytes == 2) return unshuffle_elements<2>(in, out.size() / 2, out.data());
  unshuffle_elements<4>(in, out.size() / 4, out.data());
}

}  // namespace

std::uint32_t fletcher32(std::span<const std::uint8_t> bytes) {
  std::uint32_t sum1 = 0, sum2 = 0;
  const std::uint8_t* p = bytes.data();
  std::size_t words = bytes.size() / 2;
  const auto fold = [](std::uint32_t s) { return (s & 0xffff) + (s >> 16); };
  while (words > 0) {
    std::size_t block = words < 360 ? words : 360;  // the sums can't overflow 32 bits before
    words -= block;
    for (; block > 0; --block, p += 2) {
      sum1 += static_cast<std::uint32_t>(p[0] << 8 | p[1]);
      sum2 += sum1;
    }
    sum1 = fold(sum1);
    sum2 = fold(sum2);
  }
  if (bytes.size() % 2 != 0) {
    sum1 += static_cast<std::uint32_t>(*p) << 8;
    sum2 += sum1;
    sum1 = fold(sum1);
    sum2 = fold(sum2);
  }
  return fold(sum2) << 16 | fold(sum1);
}

ChunkEncoder::ChunkEncoder() : compressor_(libdeflate_alloc_compressor(kDeflateLevel)) {
  if (!compressor_) throw Error(ErrorCode::kFailed, "out of memory for the compressor");
}
ChunkEncoder::~ChunkEncoder() { libdeflate_free_compressor(static_cast<libdeflate_compressor*>(compressor_)); }

std::vector<std::uint8_t> ChunkEncoder::encode(std::span<const std::uint8_t> values, std::size_t element_bytes) {
  auto* compressor = static_cast<libdeflate_compressor*>(compressor_);
  const std::uint8_t* source = values.data();
  if (element_bytes > 1) {
    shuffled_.resize(values.size());
    shuffle(values, element_bytes, shuffled_.data());
    source = shuffled_.data();
  }
  const std::size_t room = libdeflate_zlib_compress_bound(compressor, values.size());
  if (deflated_.size() < room) deflated_.resize(room);
  const std::size_t size = libdeflate_zlib_compress(compressor, source, values.size(), deflated_.data(), room);
  if (size == 0) throw Error(ErrorCode::kFailed, "the compressor ran out of room");
  const std::uint32_t sum = fletcher32({deflated_.data(), size});
  std::vector<std::uint8_t> out(size + kChecksum_bytes);
  std::memcpy(out.data(), deflated_.data(), size);
  std::memcpy(out.data() + size, &sum, sizeof sum);
  return out;
}

ChunkDecoder::ChunkDecoder() : decompressor_(libdeflate_alloc_decompressor()) {
  if (!decompressor_) throw Error(ErrorCode::kFailed, "out of memory for the decompressor");
}
ChunkDecoder::~ChunkDecoder() { libdeflate_free_decompressor(static_cast<libdeflate_decompressor*>(decompressor_)); }

bool ChunkDecoder::decode(std::span<const std::uint8_t> stored, std::size_t element_bytes,
                          std::span<std::uint8_t> values) {
  if (stored.size() <= kChecksum_bytes) return false;
  const auto stream = stored.first(stored.size() - kChecksum_bytes);
  std::uint32_t sum = 0;
  std::memcpy(&sum, stream.data() + stream.size(), sizeof sum);
  if (sum != fletcher32(stream)) return false;
  std::uint8_t* target = values.data();
  if (element_bytes > 1) {
    shuffled_.resize(values.size());
    target = shuffled_.data();
  }
  // A null size pointer asks for exactly values.size() bytes.
  if (libdeflate_zlib_decompress(static_cast<libdeflate_decompressor*>(decompressor_), stream.data(), stream.size(),
                                 target, values.size(), nullptr) != LIBDEFLATE_SUCCESS)
    return false;
  if (element_bytes > 1) unshuffle(shuffled_.data(), element_bytes, values);
  return true;
}

}  // namespace btms
