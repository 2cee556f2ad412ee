#include "io/points/lzf.h"

#include <random>

#include "tests/io/points/lzf_bytes.h"

namespace btms::test {
namespace {

// Runs, repeats and noise, as columns of coordinates have them.
Bytes mixed(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  Bytes bytes;
  while (bytes.size() < n) {
    const std::size_t run = random() % 3000;
    const auto value = static_cast<std::uint8_t>(random());
    const auto kind = random() % 3;
    for (std::size_t i = 0; i < run; ++i)
      bytes.push_back(kind == 0   ? value
                      : kind == 1 ? static_cast<std::uint8_t>(i % 7)
                                  : static_cast<std::uint8_t>(random()));
  }
  bytes.resize(n);
  return bytes;
}

TEST(Lzf, GivesAnyPartOfTheOutput) {
  const TemporaryFolder folder;
  for (const std::size_t n : {0, 1, 33, 5000, 131'072, 1'000'000}) {
    SCOPED_TRACE(n);
    const Bytes plain = mixed(n, 3), packed = lzf_compress(plain);
    Bytes bytes(17);  // the range does not begin at the start of the file
    bytes.insert(bytes.end(), packed.begin(), packed.end());
    const InputFile file(folder.write("a", bytes));
    const LzfRange range(file, 17, packed.size(), n);
    const InputFile::Session session = file.open();
    std::vector<std::uint8_t> scratch;
    std::mt19937 random(4);
    for (int round = 0; round < 50; ++round) {
      const std::size_t from = round == 0 ? 0 : random() % (n + 1), count = round == 0 ? n : random() % (n - from + 1);
      Bytes part(count);
      range.read(file, session, from, part, scratch);
      ASSERT_TRUE(std::equal(part.begin(), part.end(), plain.begin() + static_cast<std::ptrdiff_t>(from)))
          << from << ' ' << count;
    }
  }
}

TEST(Lzf, RefusesWhatDoesNotFit) {
  const TemporaryFolder folder;
  struct Case {
    const char* says;
    Bytes packed;
    std::uint64_t output;
  };
  const std::vector<Case> cases = {
      {"before their start", {0x00, 'a', 0x20, 0x01}, 4},  // two back, one there
      {"before their start", {0x20, 0x00}, 3},
      {"expected 4", {0x02, 'a', 'b', 'c'}, 4},  // too short
      {"expected 2", {0x02, 'a', 'b', 'c'}, 2},  // too long
      {"damaged", {0x05, 'a', 'b'}, 6},          // cut in a literal
      {"damaged", {0x00, 'a', 0xE0, 0x01}, 11},  // cut in a copy
      {"expected 4294967295", {0x00, 'a', 0x20, 0x00}, 4'294'967'295},
      {"expected 1", {}, 1},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.says);
    const auto path = folder.write("a", c.packed);
    const InputFile file(path);
    expect_error(ErrorCode::kBadInput, path, {c.says}, [&] { LzfRange(file, 0, c.packed.size(), c.output); });
  }
}

TEST(Lzf, SurvivesNoise) {
  const TemporaryFolder folder;
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    Bytes noise(random() % 4000);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    const InputFile file(folder.write("a", noise));
    EXPECT_THROW(LzfRange(file, 0, noise.size(), 100'000'000), Error);
  }
}

}  // namespace
}  // namespace btms::test
