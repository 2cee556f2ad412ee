#include "io/store/chunk_codec.h"

#include <gtest/gtest.h>

#include <memory>
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

// ISA-L's own streams depend on where the compressor lies in memory: about one in a thousand of these would differ.
TEST(ChunkCodec, TheSameValuesGiveTheSameBytesWhereverTheCompressorIs) {
  std::mt19937 random(2);
  std::vector<std::unique_ptr<ChunkEncoder>> encoders;
  std::vector<std::unique_ptr<std::vector<std::uint8_t>>> between;
  for (int i = 0; i < 24; ++i) {
    encoders.push_back(std::make_unique<ChunkEncoder>());
    between.push_back(std::make_unique<std::vector<std::uint8_t>>(random() % 300'000));
  }
  for (int round = 0; round < 150; ++round) {
    std::vector<std::uint8_t> values(1 + random() % 1200);
    for (std::uint8_t& v : values) v = static_cast<std::uint8_t>(random() % 3);
    const std::vector<std::uint8_t> stored = encoders[0]->encode(values, 1);
    std::vector<std::uint8_t> back(values.size());
    EXPECT_TRUE(ChunkDecoder().decode(stored, 1, back) && back == values) << values.size();
    for (std::size_t i = 1; i < encoders.size(); ++i) EXPECT_EQ(encoders[i]->encode(values, 1), stored) << round;
  }
}

}  // namespace
}  // namespace btms
