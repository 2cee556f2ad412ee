// The program on real surveys and scans: labels change nothing but the class, floors of accuracy, memory. Needs
// BTMS_DATA.
#include <cstdlib>
#include <cstring>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

class DataCli : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::getenv("BTMS_DATA")) GTEST_SKIP() << "BTMS_DATA is not set: real surveys and scans are not here";
  }
  static std::string data(const std::string& name) { return (fs::path(std::getenv("BTMS_DATA")) / name).string(); }

  TempFolder folder_;
};

// Everything but the class bits: header, VLRs, records, trailing bytes. Point formats 0-5: low 5 bits of byte 15.
void expect_only_classes_differ(const std::string& before, const std::string& after, std::size_t expected_changes) {
  ASSERT_EQ(before.size(), after.size());
  std::uint32_t offset = 0;
  std::uint16_t length = 0;
  std::memcpy(&offset, before.data() + 96, 4);
  std::memcpy(&length, before.data() + 105, 2);
  ASSERT_LT(before[104] & 63, 6);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] == after[i]) continue;
    const bool class_byte = i >= offset && (i - offset) % length == 15;
    ASSERT_TRUE(class_byte) << "byte " << i;
    ASSERT_EQ(before[i] & 0xe0, after[i] & 0xe0) << "flags of byte " << i;
    ++changed;
  }
  EXPECT_GT(changed, expected_changes);
}

TEST_F(DataCli, CityTileIsLabelledInPlaceAndScores) {
  const std::string input = data("city/ahn3_delft_1.las");
  const auto build = run_json({"build", input, "-o", folder_ / "a.btms"});
  EXPECT_EQ(build["points"], 640510);
  run_json({"label", folder_ / "a.btms", input, "-o", folder_ / "out"});
  expect_only_classes_differ(read_text(input), read_text(folder_ / "out/ahn3_delft_1.las"), 100000);
  const auto scores = run_json(
      {"eval", "--truth", input, "--prediction", folder_ / "out/ahn3_delft_1.las"})["files"][0]["without_ambiguous"];
  EXPECT_GE(scores["kappa"].get<double>(), 0.93);
}

TEST_F(DataCli, SquareKilometre) {
  const std::string input = data("city/nrw_291_5744.las");
  run_json({"build", input, "-o", folder_ / "n.btms"});
  run_json({"label", folder_ / "n.btms", input, "-o", folder_ / "out"});
  expect_only_classes_differ(read_text(input), read_text(folder_ / "out/nrw_291_5744.las"), 100000);
}

TEST_F(DataCli, TwoForestFilesAreOneMapWithoutASeam) {
  const std::string a = data("forest/bcts_1.las"), b = data("forest/bcts_2.las");
  const auto build = run_json({"build", a, b, "-o", folder_ / "f.btms"});
  EXPECT_EQ(build["points"], 531662 + 823945);
  EXPECT_EQ(run_json({"build", b, a, "-o", folder_ / "g.btms"})["digest"], build["digest"]);
  const auto labels = run_json({"label", folder_ / "f.btms", a, b, "-o", folder_ / "out"});
  expect_only_classes_differ(read_text(a), read_text(folder_ / "out/bcts_1.las"), 1000);
  expect_only_classes_differ(read_text(b), read_text(folder_ / "out/bcts_2.las"), 1000);
}

TEST_F(DataCli, OutliersFarOffDoNotCostGigabytes) {
  const std::string input = data("robot/hku_campus_5cm.pcd");
  const auto build =
      run_json({"build", input, "-o", folder_ / "c.btms", "--preset", "paper-partial-map", "--resolution", "0.5"});
  EXPECT_EQ(build["points"], 2423802);
  EXPECT_LT(build["peak_rss_bytes"].get<double>(), 400e6);
  const auto labels = run_json({"label", folder_ / "c.btms", input, "-o", folder_ / "out"});
  EXPECT_EQ(fs::file_size(folder_ / "out/hku_campus_5cm.labels"), 2423802u);
}

// Mean F1 and accuracy without the ambiguous class.
std::pair<double, double> score_scans(const std::string& velodyne, const std::string& labels, const fs::path& folder,
                                      const std::string& preset) {
  run_json({"segment", velodyne, "-o", folder / "labels", "--force", "--preset", preset});
  const auto scores = run_json({"eval", "--truth", labels, "--prediction", folder / "labels", "--points", velodyne});
  const auto& mean = scores["without_ambiguous"]["mean"];
  return {mean["f1"].get<double>(), mean["accuracy"].get<double>()};
}

TEST_F(DataCli, FullScansScore) {
  const std::string scans = data("semantickitti/full_scans/velodyne"), truth = data("semantickitti/full_scans/labels");
  const auto [f1, accuracy] = score_scans(scans, truth, folder_ / "new", "single-scan");
  EXPECT_GE(f1, 0.995);
  EXPECT_GE(accuracy, 0.992);
  EXPECT_GE(score_scans(scans, truth, folder_ / "map", "partial-map").first, 0.994);
  EXPECT_GE(score_scans(scans, truth, folder_ / "paper", "paper-single-scan").first, 0.993);
}

TEST_F(DataCli, ThinnedScansScore) {
  const auto [f1, accuracy] = score_scans(data("semantickitti/sequences/00/velodyne"),
                                          data("semantickitti/sequences/00/labels"), folder_ / "s", "single-scan");
  EXPECT_GE(f1, 0.987);
  EXPECT_GE(accuracy, 0.983);
}

// F1 without the ambiguous class of the preset partial-map on the 22 scans, put together with these poses.
class PartialMap : public DataCli {
 protected:
  double f1(const std::string& poses, const std::vector<std::string>& more) {
    const std::string sequence = data("semantickitti/sequences/00/"), map = folder_ / (poses + ".las");
    std::vector<std::string> call{
        "accumulate", "--scans", sequence + "velodyne", "--labels", sequence + "labels", "--poses", sequence + poses,
        "-o",         map};
    call.insert(call.end(), more.begin(), more.end());
    alignment_ = run_json(call).value("alignment", nlohmann::json());
    run_json({"build", map, "-o", folder_ / (poses + ".btms"), "--preset", "partial-map"});
    run_json({"label", folder_ / (poses + ".btms"), map, "-o", folder_ / "labels"});
    return run_json({"eval", "--truth", map, "--prediction", folder_ / ("labels/" + poses + ".las"), "--label-map",
                     "partial-map"})["without_ambiguous"]["pooled"]["f1"];
  }
  nlohmann::json alignment_;
};

TEST_F(PartialMap, OfRegisteredPosesIsSegmentedWell) { EXPECT_GE(f1("poses_velo_icp.txt", {}), 0.984); }

// The ground of the official poses is smeared by a tilt of the camera.
TEST_F(PartialMap, OfDriftingPosesIsToo) {
  EXPECT_GE(f1("poses.txt", {"--calib", data("semantickitti/sequences/00/calib.txt"), "--align-ground"}), 0.97);
  EXPECT_GT(alignment_["smear_before_m"], 0.13) << alignment_;
  EXPECT_LT(alignment_["smear_after_m"], 0.035) << alignment_;
}

TEST_F(PartialMap, AlignmentLeavesGoodPosesAlone) {
  EXPECT_GE(f1("poses_velo_icp.txt", {"--align-ground"}), 0.984);
  EXPECT_LT(alignment_["largest_correction_m"], 0.01) << alignment_;
  EXPECT_LE(alignment_["smear_after_m"], alignment_["smear_before_m"]) << alignment_;
}

}  // namespace
}  // namespace btms::test
