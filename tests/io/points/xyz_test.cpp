#include <thread>

#include "tests/io/points/malformed_xyz.h"

namespace btms::test {
namespace {

// Two points, (1.5, -2, 3) and (4, 5.0005, 6000).
void expect_points(const std::string& text, const PointFileOptions& options = {}) {
  SCOPED_TRACE(text);
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.csv", bytes_of_text(text)), options);
  EXPECT_TRUE(file->info().warnings.empty()) << testing::PrintToString(file->info().warnings);
  ASSERT_EQ(file->size(), 2U);
  const PointBlock block = read_all(*file);
  EXPECT_EQ(block.x_mm, (std::vector<std::int64_t>{1500, 4000}));
  EXPECT_EQ(block.y_mm, (std::vector<std::int64_t>{-2000, 5000}));
  EXPECT_EQ(block.z_mm, (std::vector<std::int32_t>{3000, 6000000}));
}

TEST(Xyz, AllSeparatorsAndNames) {
  expect_points("1.5 -2 3\n4 5.0005 6000");
  expect_points("1.5\t-2\t3\t9\n4\t5.0005\t6e3\t9\n");
  expect_points("1.5,-2,3\n4,5.0005,6000\n");
  expect_points("1.5 , -2, +3,\n\n4,5.0005,6000,\n");
  expect_points("# scan of today\n1.5;-2;3;wall\n4;5.0005;6000;\n# the end\n");
  expect_points("//X Y Z Intensity\n2\n1.5 -2 3 7\n4 5.0005 6000 8\n");  // CloudCompare
  expect_points("\"Intensity\",\"Z\",\"Y\",\"X\"\n7,3,-2,1.5\n8,6000,5.0005,4\n");
  expect_points("Northing Easting class Elevation\n-2 1.5 2 3\n5.0005 4 2 6000\n");
  expect_points("# z y x\n3 -2 1.5\n6000 5.0005 4\n");
}

TEST(Xyz, ColumnsAreChosen) {
  expect_points("P1,-2,1.5,3,tree\nP2,5.0005,4,6000,\n", {.crs = {}, .columns = "3,2,4"});
  expect_points("P1,-2,1.5,3,tree\nP2,5.0005,4,6000,\n", {.crs = {}, .columns = "id, y, x, z"});
  expect_points("east north up\n1.5 -2 3\n4 5.0005 6000\n", {.crs = {}, .columns = "1,2,3"});
  const TemporaryFolder folder;
  const auto path = folder.write("a.xyz", bytes_of_text("1 2 3\n4 5 6\n"));
  for (const char* columns : {"1,2", "1,2,2", "0,1,2", "x,y", "x,y,z,x", "1,y,3", ",", "1,2,3,4,5"})
    EXPECT_THROW(
        try { open_points(path, {.crs = {}, .columns = columns}); } catch (const Error& e) {
          EXPECT_EQ(e.code(), ErrorCode::kUsage) << columns;
          throw;
        },
        Error)
        << columns;
  expect_error(ErrorCode::kBadInput, path, {"3 columns", "z is to be in column 4"},
               [&] { open_points(path, {.crs = {}, .columns = "1,2,4"}); });
}

TEST(Xyz, BadInputIsRefused) {
  const TemporaryFolder folder;
  for (const Malformed& bad : bad_xyz_files()) {
    SCOPED_TRACE(bad.name);
    const auto path = folder.write("bad.xyz", bad.make());
    expect_error(ErrorCode::kBadInput, path, bad.says, [&] { open_points(path); });
  }
  for (const Malformed& bad : unreadable_xyz_files()) {
    SCOPED_TRACE(bad.name);
    const auto path = folder.write("bad.xyz", bad.make());
    expect_error(ErrorCode::kBadInput, path, bad.says, [&] { read_all(*open_points(path)); });
  }
}

TEST(Xyz, WhatIsNotFiniteOrFarIsDropped) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.txt", bytes_of_text("1 2 3\nnan 2 3\n1 -inf 3\n1 2 1e9\n1e400 2 3\n")));
  const PointBlock block = read_all(*file);
  EXPECT_EQ(block.not_finite, 3U);
  EXPECT_EQ(block.out_of_range, 1U);
}

TEST(Xyz, AnyRunIsThatPartOfTheWhole) {
  const TemporaryFolder folder;
  std::string text = "// X,Y,Z\n";
  for (int i = 0; i < 5000; ++i)
    text += std::to_string(i) + "," + std::to_string(2 * i) + ".25,-1\n" + (i % 7 ? "" : "#\n");
  const auto file = open_points(folder.write("a.xyz", bytes_of_text(text)));
  ASSERT_EQ(file->size(), 5000U);
  const PointBlock whole = read_all(*file);
  std::vector<std::thread> threads;
  for (const std::uint64_t first : {0, 1, 1023, 1024, 3000})
    threads.emplace_back([&, first] {
      PointBlock part;
      file->read(first, 1999, part);
      for (std::size_t i = 0; i < 1999; ++i) EXPECT_EQ(part.y_mm[i], whole.y_mm[first + i]);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(Xyz, HasClasses) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.csv", bytes_of_text("x,y,z,Classification\n1,2,3,2\n4,5,6,18\n"));
  EXPECT_EQ(read_classes(path), (std::vector<std::uint32_t>{2, 18}));
  const auto none = folder.write("b.csv", bytes_of_text("1,2,3,2\n"));
  expect_error(ErrorCode::kBadInput, none, {"no column is called class"}, [&] { read_classes(none); });
  const auto half = folder.write("c.csv", bytes_of_text("x,y,z,class\n1,2,3,2.5\n"));
  expect_error(ErrorCode::kBadInput, half, {"point 1", "whole number"}, [&] { read_classes(half); });
}

TEST(Xyz, FoldersGiveOnlyWhatIsCalledXyz) {
  const TemporaryFolder folder;
  folder.write("a.xyz", bytes_of_text("1 2 3\n"));
  folder.write("readme.txt", bytes_of_text("words\n"));
  folder.write("table.csv", bytes_of_text("1,2\n"));
  const std::vector<std::string> arguments{(folder / "a.xyz").parent_path().string()};
  ASSERT_EQ(expand_inputs(arguments).paths.size(), 1U);
}

}  // namespace
}  // namespace btms::test
