#include "io/store/chunk_codec.h"

#include <isa-l/igzip_lib.h>

#include <algorithm>
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

// More than a zlib stream takes. What can't be compressed is stored, in blocks of some thousand bytes.
constexpr std::size_t zlib_bound(std::size_t bytes) { return bytes + bytes / 64 + 1024; }

// The library only reads from where next_in points.
std::uint8_t* input(std::span<const std::uint8_t> bytes) { return const_cast<std::uint8_t*>(bytes.data()); }

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

bool has_checksum(std::span<const std::uint8_t> stored) {
  if (stored.size() <= kChecksum_bytes) return false;
  std::uint32_t sum = 0;
  std::memcpy(&sum, stored.data() + stored.size() - kChecksum_bytes, sizeof sum);
  return sum == fletcher32(stored.first(stored.size() - kChecksum_bytes));
}

std::vector<std::uint8_t> ChunkEncoder::encode(std::span<const std::uint8_t> values, std::size_t element_bytes) {
  std::span<const std::uint8_t> source = values;
  if (element_bytes > 1) {
    shuffled_.resize(values.size());
    shuffle(values, element_bytes, shuffled_.data());
    source = shuffled_;
  }
  deflated_.resize(std::max(deflated_.size(), zlib_bound(values.size())));
  const auto deflated = deflater_.deflate(source, deflated_);
  if (!deflated) throw Error(ErrorCode::kFailed, "the compressor could not compress a chunk");
  const std::size_t size = *deflated;
  const std::uint32_t sum = fletcher32({deflated_.data(), size});
  std::vector<std::uint8_t> out(size + kChecksum_bytes);
  std::memcpy(out.data(), deflated_.data(), size);
  std::memcpy(out.data() + size, &sum, sizeof sum);
  return out;
}

ChunkDecoder::ChunkDecoder() : state_(std::make_unique<inflate_state>()) {}
ChunkDecoder::~ChunkDecoder() = default;

bool ChunkDecoder::decode(std::span<const std::uint8_t> stored, std::size_t element_bytes,
                          std::span<std::uint8_t> values) {
  if (!has_checksum(stored)) return false;
  const auto stream = stored.first(stored.size() - kChecksum_bytes);
  std::uint8_t* target = values.data();
  if (element_bytes > 1) {
    shuffled_.resize(values.size());
    target = shuffled_.data();
  }
  isal_inflate_init(state_.get());
  state_->crc_flag = ISAL_ZLIB;
  state_->next_in = input(stream);
  state_->avail_in = static_cast<std::uint32_t>(stream.size());
  state_->next_out = target;
  state_->avail_out = static_cast<std::uint32_t>(values.size());
  if (isal_inflate_stateless(state_.get()) != ISAL_DECOMP_OK || state_->total_out != values.size()) return false;
  if (element_bytes > 1) unshuffle(shuffled_.data(), element_bytes, values);
  return true;
}

}  // namespace btms
