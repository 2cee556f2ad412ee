#include <cmath>

#include "tests/io/points/malformed.h"
#include "tests/io/points/ply_bytes.h"

namespace btms::test {
namespace {

const std::string kSound = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";

Bytes npy(const std::string& text, const Bytes& data, char version = 1) {
  const auto n = static_cast<std::uint32_t>(text.size());
  Bytes bytes = text_bytes(std::string("\x93NUMPY") + version + '\0');
  if (version == 1)
    append(bytes, static_cast<std::uint16_t>(n));
  else
    append(bytes, n);
  const Bytes rest = text + data;
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
}

template <typename T>
Bytes numbers(bool big_endian, std::size_t columns) {
  Bytes bytes;
  for (std::size_t i = 0; i < 2 * columns; ++i) {
    append(bytes, static_cast<T>(static_cast<double>(i) * 1.5));
    if (big_endian) std::reverse(bytes.end() - sizeof(T), bytes.end());
  }
  return bytes;
}

void expect_points(const Bytes& bytes, std::int64_t columns) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.npy", bytes));
  ASSERT_EQ(file->size(), 2U);
  EXPECT_TRUE(file->info().warnings.empty());
  const PointBlock block = read_all(*file);
  for (std::int64_t i = 0; i < 2; ++i) {
    EXPECT_EQ(block.x_mm[static_cast<std::size_t>(i)], 1500 * columns * i);
    EXPECT_EQ(block.y_mm[static_cast<std::size_t>(i)], 1500 * (columns * i + 1));
    EXPECT_EQ(block.z_mm[static_cast<std::size_t>(i)], 1500 * (columns * i + 2));
  }
}

TEST(Npy, GivesThePoints) {
  for (const char version : {char{1}, char{2}, char{3}})
    expect_points(npy(kSound + "   \n", numbers<double>(false, 3), version), 3);
  expect_points(npy("{\"shape\":(2,5),\"fortran_order\":False,\"descr\":\"<f4\"}", numbers<float>(false, 5)), 5);
  expect_points(npy("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 4)}", numbers<float>(true, 4)), 4);
  expect_points(npy("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3)}", numbers<double>(true, 3)), 3);
}

TEST(Npy, BadInputIsRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const Bytes& bytes, const std::vector<std::string>& says) {
    const auto path = folder.write("bad.npy", bytes);
    expect_error(ErrorCode::kBadInput, path, says, [&] { open_points(path); });
  };
  const auto with = [](const std::string& what, const std::string& by) {
    std::string text = kSound;
    return npy(text.replace(text.find(what), what.size(), by), Bytes(48));
  };
  const Bytes whole = npy(kSound, Bytes(48));
  for (std::size_t n = 0; n < whole.size(); ++n) refused({whole.begin(), whole.begin() + static_cast<int>(n)}, {""});
  refused(npy(kSound, Bytes(47)), {"declares 2 points of 24 bytes, found 1"});
  refused(npy(kSound, Bytes(48), 4), {"version 4.0"});
  refused(with("(2, 3)", "(9000000000000000000, 3)"), {"found 2 whole"});
  refused(with("(2, 3)", "(99999999999999999999, 3)"), {"whole number"});
  refused(with("(2, 3)", "(-2, 3)"), {"whole number"});
  refused(with("(2, 3)", "(2, 2)"), {"rows of 2"});
  refused(with("(2, 3)", "(6,)"), {"whole number"});
  refused(with("(2, 3)", "(1, 2, 3)"), {"where a )"});
  refused(with("<f8", "<i4"), {"type <i4"});
  refused(with("<f8", "|O"), {"type |O"});
  refused(with("'<f8'", "[('x', '<f4')]"), {"plain numbers"});
  refused(with("False", "True"), {"Fortran order"});
  refused(with("False", "0"), {"neither True"});
  refused(with("shape", "descr"), {"\"descr\""});
  refused(with(", 'shape': (2, 3)", ""), {"missing"});
  refused(with(", }", ", } x"), {"behind"});
  refused(text_bytes("PK\x03\x04 an archive of arrays"), {"not an NPY file"});
}

}  // namespace
}  // namespace btms::test
