#include "io/store/chunk_codec.h"

#include <gtest/gtest.h>

#include <random>

namespace btms {
namespace {

// What can't be compressed is stored, and takes more room than it had.
TEST(ChunkCodec, NoiseReadsBackAtItsOwnSizeOnly) {
  std::mt19937 random(1);
  ChunkEncoder encoder;
  ChunkDecoder decoder;
  for (const std::size_t size : {4u, 65532u, 65536u, 131072u, 4u << 16}) {
    std::vector<std::uint8_t> values(size), back(size), longer(size + 4);
    for (std::uint8_t& v : values) v = static_cast<std::uint8_t>(random());
    for (const std::size_t element_bytes : {1u, 2u, 4u}) {
      const std::vector<std::uint8_t> stored = encoder.encode(values, element_bytes);
      EXPECT_GT(stored.size(), size);
      EXPECT_TRUE(decoder.decode(stored, element_bytes, back));
      EXPECT_EQ(back, values) << size;
      EXPECT_FALSE(decoder.decode(stored, element_bytes, longer));
      EXPECT_FALSE(decoder.decode(stored, element_bytes, std::span(back).first(size - 4)));
    }
  }
}

}  // namespace
}  // namespace btms
