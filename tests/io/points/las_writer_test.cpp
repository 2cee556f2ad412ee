#include "io/points/las_writer.h"

#include "tests/io/points/files.h"

namespace btms::test {
namespace {

TEST(LasWriter, WritesWhatTheReaderReads) {
  const TemporaryFolder folder;
  std::vector<LasPoint> points;
  for (int i = 0; i < 40'000; ++i) {
    points.push_back({691'234'567 + 100 * i, -5'334'000'001 - i, i - 20'000, static_cast<std::uint8_t>(i % 256),
                      static_cast<std::uint16_t>(i)});
  }
  const auto writer = LasWriter::create(folder / "a.las");
  writer->append(std::span(points).first(1));
  writer->append({});
  writer->append(std::span(points).subspan(1));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.las"));
  writer->commit();

  const auto file = open_points(folder / "a.las");
  EXPECT_EQ(file->info().format, "LAS 1.4, point format 6");
  EXPECT_TRUE(file->info().warnings.empty());
  ASSERT_TRUE(file->info().declared_bounds_m);
  const std::array<double, 6> bounds = {691'234.567, -5'334'040.0, -20, 695'234.467, -5'334'000.001, 19.999};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ((*file->info().declared_bounds_m)[i], bounds[i]);
  const PointBlock block = read_all(*file);
  const auto classes = read_classes(folder / "a.las");
  ASSERT_EQ(block.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(block.x_mm[i], points[i].x_mm);
    ASSERT_EQ(block.y_mm[i], points[i].y_mm);
    ASSERT_EQ(block.z_mm[i], points[i].z_mm);
    ASSERT_EQ(classes[i], points[i].classification);
  }
}

TEST(LasWriter, WritesPointsOf20BytesToo) {
  const TemporaryFolder folder;
  const std::vector<LasPoint> points = {{1, 2, 3, 31, 4}, {-500, 700, -9, 2, 65535}};
  const auto writer = LasWriter::create(folder / "a.las", {}, LasPointFormat::k0);
  writer->append(points);
  writer->commit();
  const auto file = open_points(folder / "a.las");
  EXPECT_EQ(file->info().format, "LAS 1.4, point format 0");
  EXPECT_TRUE(file->info().warnings.empty());
  EXPECT_EQ(file->info().bytes, 375 + 2 * 20);
  const PointBlock block = read_all(*file);
  EXPECT_EQ(block.x_mm, (std::vector<std::int64_t>{1, -500}));
  EXPECT_EQ(block.y_mm, (std::vector<std::int64_t>{2, 700}));
  EXPECT_EQ(block.z_mm, (std::vector<std::int32_t>{3, -9}));
  EXPECT_EQ(read_classes(folder / "a.las"), (std::vector<std::uint32_t>{31, 2}));

  const LasPoint user_class{0, 0, 0, 32};
  EXPECT_THROW(LasWriter::create(folder / "b.las", {}, LasPointFormat::k0)->append({&user_class, 1}), Error);
}

TEST(LasWriter, KeepsTheCoordinateSystem) {
  const TemporaryFolder folder;
  const std::string wkt =
      "PROJCS[\"zone\",GEOGCS[\"g\",DATUM[\"d\",SPHEROID[\"s\",6378137,298.257222101]],PRIMEM[\"Greenwich\",0],UNIT["
      "\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"central_meridian\",9],PARAMETER["
      "\"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000],UNIT[\"metre\",1]]";
  const auto writer = LasWriter::create(folder / "a.las", wkt);
  const LasPoint point{1, 2, 3};
  writer->append({&point, 1});
  writer->commit();
  const auto file = open_points(folder / "a.las");
  EXPECT_EQ(file->info().crs, wkt);
  EXPECT_EQ(read_all(*file).x_mm[0], 1);
}

TEST(LasWriter, IsTheSameFileForTheSamePoints) {
  const TemporaryFolder folder;
  for (const char* name : {"a.las", "b.las"}) {
    const auto writer = LasWriter::create(folder / name);
    const LasPoint points[] = {{1, 2, 3, 4, 5}, {-6, -7, -8, 9, 10}};
    writer->append(points);
    writer->commit();
  }
  EXPECT_EQ(read_bytes(folder / "a.las"), read_bytes(folder / "b.las"));
}

TEST(LasWriter, WritesAnEmptyFile) {
  const TemporaryFolder folder;
  LasWriter::create(folder / "a.las")->commit();
  const auto file = open_points(folder / "a.las");
  EXPECT_EQ(file->size(), 0u);
  expect_warning(file->info(), "no points");
}

TEST(LasWriter, LeavesNothingBehindWithoutCommit) {
  const TemporaryFolder folder;
  {
    const auto writer = LasWriter::create(folder / "a.las");
    const LasPoint point{1, 2, 3};
    writer->append({&point, 1});
  }
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(LasWriter, RefusesWhatItCannotHold) {
  const TemporaryFolder folder;
  const auto path = folder / "a.las";
  const auto writer = LasWriter::create(path);
  const LasPoint points[] = {{0, 0, 0}, {std::int64_t{1} << 31, 0, 0}};
  expect_error(ErrorCode::kFailed, path, {"x = 2147483648", "2147 km"}, [&] { writer->append(points); });
  expect_error(ErrorCode::kFailed, path, {"65534"}, [&] { LasWriter::create(path, std::string(70'000, 'x')); });
  const auto nowhere = folder / "missing" / "a.las";
  expect_error(ErrorCode::kFailed, nowhere, {"No such file"}, [&] { LasWriter::create(nowhere); });
}

}  // namespace
}  // namespace btms::test
