// Bad, odd and empty inputs through the real program: refused or counted, never half-written.
#include <cmath>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

TEST(CliInput, BadFilesExitWith3AndLeaveNothing) {
  const TempFolder folder;
  run_json({"synth", "--points", "20000", "-o", folder / "good"});
  const std::string las = read_text(folder / "good/city.las");
  write_text(folder / "truncated.las", las.substr(0, las.size() / 2));
  write_text(folder / "header.las", las.substr(0, 100));
  write_text(folder / "empty.las", "");
  write_text(folder / "text.las", "this is not a LAS file, whatever its name says\n");
  write_text(folder / "odd.bin", "12345");
  write_text(folder / "text.pcd", "hello\n");
  for (const std::string name : {"truncated.las", "header.las", "empty.las", "text.las", "odd.bin", "text.pcd"}) {
    const Outcome outcome =
        run({"build", folder / "good/city.las", folder / name, "-o", folder / "map.btms", "--json"});
    EXPECT_EQ(outcome.status, 3) << name << ": " << outcome.err;
    EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.json()["error"]["code"], "bad_input") << name;
    EXPECT_FALSE(fs::exists(folder / "map.btms")) << name;
    EXPECT_EQ(run({"info", folder / name}).status, 3) << name;
  }
}

TEST(CliInput, AFailedBuildLeavesTheOlderMapAlone) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  write_scan(folder / "nan.bin", {{NAN, NAN, NAN}});
  const auto built = run_json({"build", folder / "scan.bin", "-o", folder / "map.btms"});
  EXPECT_EQ(run({"build", folder / "nan.bin", "-o", folder / "map.btms"}).status, 3);
  EXPECT_EQ(run_json({"digest", folder / "map.btms"})["digest"], built["digest"]);
}

TEST(CliInput, AFileOrAForeignFolderIsNoPlaceForAMap) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  write_text(folder / "file.btms", "precious");
  EXPECT_EQ(run({"build", folder / "scan.bin", "-o", folder / "file.btms"}).status, 2);
  EXPECT_EQ(read_text(folder / "file.btms"), "precious");
  fs::create_directories(folder / "photos");
  write_text(folder / "photos/cat.jpg", "precious");
  EXPECT_EQ(run({"build", folder / "scan.bin", "-o", folder / "photos"}).status, 2);
  EXPECT_EQ(names_in(folder / "photos"), std::vector<std::string>{"cat.jpg"});
  EXPECT_EQ(run({"info", folder / "photos"}).status, 3);
}

TEST(CliInput, PointsThatAreNoNumbersAreDroppedAndCounted) {
  const TempFolder folder;
  auto points = floor_and_wall();
  points[7] = {NAN, 0, 0};
  points[8] = {0, INFINITY, 0};
  points[9] = {0, 0, 1e30f};
  write_scan(folder / "scan.bin", points);
  const auto built =
      run_json({"build", folder / "scan.bin", "-o", folder / "map.btms", "--preset", "paper-single-scan"});
  EXPECT_EQ(built["dropped"]["not_finite"], 2);
  EXPECT_EQ(built["dropped"]["out_of_range"], 1);
  EXPECT_EQ(built["points"], points.size() - 3);
  const auto label = run_json({"label", folder / "map.btms", folder / "scan.bin", "-o", folder / "out"});
  EXPECT_EQ(label["total"]["dropped"], 3);
  const std::string labels = read_text(folder / "out/scan.label");
  ASSERT_EQ(labels.size(), 4 * points.size());
  EXPECT_EQ(labels.substr(4 * 7, 12), std::string(12, '\0'));
}

TEST(CliInput, BuildOfNothingIsBadInput) {
  const TempFolder folder;
  write_text(folder / "a.bin", "");
  write_text(folder / "b.bin", "");
  EXPECT_EQ(run({"build", folder / "a.bin", folder / "b.bin", "-o", folder / "map.btms"}).status, 3);
  EXPECT_FALSE(fs::exists(folder / "map.btms"));
}

TEST(CliSegment, SegmentsScansAndTakesAnEmptyOneAsAResult) {
  const TempFolder folder;
  const auto points = floor_and_wall();
  write_scan(folder / "000000.bin", points);
  write_text(folder / "000001.bin", "");
  const auto result = run_json({"segment", folder / "000000.bin", folder / "000001.bin", "-o", folder / "out"});
  EXPECT_EQ(names_in(folder / "out"), (std::vector<std::string>{"000000.label", "000001.label"}));
  EXPECT_EQ(fs::file_size(folder / "out/000000.label"), 4 * points.size());
  EXPECT_EQ(fs::file_size(folder / "out/000001.label"), 0u);
  EXPECT_GT(result["files"][0]["terrain"], 35000);
  EXPECT_GT(result["files"][0]["obstacle"], 1500);
  EXPECT_GE(result["mean_scan_seconds"], 0);
  const Outcome again = run({"segment", folder / "000001.bin", "-o", folder / "again"});
  EXPECT_EQ(again.status, 0);
  EXPECT_NE(again.err.find("warning"), std::string::npos) << again.err;
}

TEST(CliEval, ScoresKittiLabelsAndNeedsTheHeightsOfAmbiguousPoints) {
  const TempFolder folder;
  for (const char* name : {"velodyne", "labels", "predicted"}) fs::create_directories(folder / name);
  write_scan(folder / "velodyne/7.bin",
             {{1, 0, -1.7f}, {2, 0, -1.7f}, {3, 0, 0.5f}, {4, 0, -1.6f}, {5, 0, 0.2f}, {6, 0, 0}});
  const auto labels = [](const std::vector<std::uint32_t>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), 4 * values.size());
  };
  // road, road (an instance above it), car, low vegetation, high vegetation, unlabelled
  write_text(folder / "labels/7.label", labels({40, 40 | 5u << 16, 10, 70, 70, 0}));
  write_text(folder / "predicted/7.label", labels({40, 99, 99, 40, 99, 40}));
  const auto eval = run_json({"eval", "--truth", folder / "labels", "--prediction", folder / "predicted"});
  const auto with = eval["with_ambiguous"]["pooled"], without = eval["without_ambiguous"]["pooled"];
  EXPECT_EQ(with["true_positive"], 2);
  EXPECT_EQ(with["false_negative"], 1);
  EXPECT_EQ(with["true_negative"], 2);
  EXPECT_EQ(without["true_positive"], 1);
  EXPECT_EQ(without["true_negative"], 1);
  fs::remove_all(folder / "velodyne");
  EXPECT_EQ(run({"eval", "--truth", folder / "labels", "--prediction", folder / "predicted"}).status, 2);
  EXPECT_EQ(
      run({"eval", "--truth", folder / "labels", "--prediction", folder / "predicted", "--sensor-height", "0"}).status,
      0);
  write_text(folder / "predicted/7.label", labels({40, 99}));
  EXPECT_EQ(
      run({"eval", "--truth", folder / "labels", "--prediction", folder / "predicted", "--sensor-height", "0"}).status,
      3);
}

TEST(CliEval, DrawsScansWithRellisLabels) {
  const TempFolder folder;
  for (const char* name : {"velodyne", "labels", "predicted"}) fs::create_directories(folder / name);
  write_scan(folder / "velodyne/7.bin", {{1, 0, -1}, {2, 0, -1}, {3, 0, 1}, {4, 0, 1}, {5, 0, 0}});
  const auto labels = [](const std::vector<std::uint32_t>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), 4 * values.size());
  };
  // grass, low bush, high bush, tree, void
  write_text(folder / "labels/7.label", labels({3, 19, 19, 4, 0}));
  write_text(folder / "predicted/7.label", labels({40, 40, 40, 99, 40}));
  const auto eval = run_json({"eval", "--label-map", "rellis", "--truth", folder / "labels", "--prediction",
                              folder / "predicted", "--picture", folder / "wrong.png"});
  const auto with = eval["with_ambiguous"]["pooled"], without = eval["without_ambiguous"]["pooled"];
  EXPECT_EQ(with["true_positive"], 2);
  EXPECT_EQ(with["false_positive"], 1);
  EXPECT_EQ(without["true_positive"], 1);
  EXPECT_EQ(without["false_positive"], 0);
  EXPECT_EQ(without["true_negative"], 1);
  EXPECT_GT(fs::file_size(folder / "wrong.png"), 100u);
}

}  // namespace
}  // namespace btms::test
