#include "io/files/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <memory>
#include <random>

namespace btms {
namespace {

// What zlib makes of a stream; `window_bits` as inflateInit2() has them.
std::vector<std::uint8_t> inflated(std::span<const std::uint8_t> stream, std::size_t bytes, int window_bits) {
  std::vector<std::uint8_t> out(bytes + 1);
  z_stream state{};
  EXPECT_EQ(inflateInit2(&state, window_bits), Z_OK);
  state.next_in = const_cast<std::uint8_t*>(stream.data());
  state.avail_in = static_cast<unsigned>(stream.size());
  state.next_out = out.data();
  state.avail_out = static_cast<unsigned>(out.size());
  EXPECT_EQ(inflate(&state, Z_FINISH), Z_STREAM_END);
  EXPECT_EQ(state.avail_in, 0u);
  out.resize(state.total_out);
  inflateEnd(&state);
  return out;
}

struct Kind {
  Wrapper wrapper;
  int window_bits;
};
constexpr Kind kKinds[] = {{Wrapper::kNone, -15}, {Wrapper::kZlib, 15}, {Wrapper::kGzip, 31}};

std::vector<std::uint8_t> values_of(std::mt19937& random, std::size_t n, unsigned symbols) {
  std::vector<std::uint8_t> values(n);
  for (std::uint8_t& v : values) v = static_cast<std::uint8_t>(random() % symbols);
  return values;
}

TEST(Deflate, ReadsBackThroughZlib) {
  std::mt19937 random(1);
  for (const Kind& kind : kKinds) {
    Deflater deflater(kind.wrapper);
    for (const std::size_t n : {0u, 1u, 3u, 4u, 5u, 7u, 64u, 1000u, 70'000u, 300'000u})
      for (const unsigned symbols : {1u, 3u, 256u}) {
        const auto values = values_of(random, n, symbols);
        std::vector<std::uint8_t> out(n + n / 64 + 1024);
        const auto size = deflater.deflate(values, out);
        ASSERT_TRUE(size) << n;
        EXPECT_EQ(inflated(std::span(out).first(*size), n, kind.window_bits), values) << n << ' ' << symbols;
      }
  }
}

TEST(Deflate, SaysWhenThereIsNoRoom) {
  std::mt19937 random(1);
  const auto noise = values_of(random, 5000, 256);
  for (const Kind& kind : kKinds) {
    Deflater deflater(kind.wrapper);
    std::vector<std::uint8_t> out(6000);
    const auto size = deflater.deflate(noise, out);
    ASSERT_TRUE(size);
    for (std::size_t room = 0; room < *size; room += room < 20 || room + 20 > *size ? 1 : 500)
      EXPECT_FALSE(deflater.deflate(noise, std::span(out).first(room))) << room;
    EXPECT_EQ(deflater.deflate(noise, std::span(out).first(*size)), size);
  }
}

// ISA-L's own streams depend on where the compressor lies in memory: about one in a thousand of these would differ.
TEST(Deflate, TheSameInputGivesTheSameBytesWhereverTheCompressorIs) {
  std::mt19937 random(2);
  std::vector<std::unique_ptr<Deflater>> deflaters;
  std::vector<std::vector<std::uint8_t>> between;
  for (int i = 0; i < 24; ++i) {
    deflaters.push_back(std::make_unique<Deflater>(Wrapper::kZlib));
    between.emplace_back(random() % 300'000);
  }
  for (int round = 0; round < 150; ++round) {
    const auto values = values_of(random, 1 + random() % 1200, 3);
    std::vector<std::uint8_t> expected(3000), out(3000);
    const auto size = deflaters[0]->deflate(values, expected);
    ASSERT_TRUE(size);
    expected.resize(*size);
    for (std::size_t i = 1; i < deflaters.size(); ++i) {
      ASSERT_EQ(deflaters[i]->deflate(values, out), size) << round;
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), out.begin())) << round;
    }
  }
}

}  // namespace
}  // namespace btms
