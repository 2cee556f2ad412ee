// Where results go: nothing that is there already is replaced unasked, and that is known before the work.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

class CliOutput : public testing::Test {
 protected:
  CliOutput() {
    write_scan(folder_ / "scan.bin", floor_and_wall());
    const Outcome built = run({"build", folder_ / "scan.bin", "-o", map(), "--preset", "paper-single-scan"});
    EXPECT_EQ(built.status, 0) << built.err;
  }
  std::string map() const { return folder_ / "map.btms"; }
  TempFolder folder_;
};

TEST_F(CliOutput, APictureReplacesNoInputAndNoPartOfAMap) {
  fs::create_hard_link(folder_ / "scan.bin", folder_ / "scan.png");
  fs::create_directories(folder_ / "folder.png");
  fs::create_directory_symlink(map(), folder_ / "link");
  const std::string bytes = read_text(folder_ / "scan.bin");
  const auto before = names_in(folder_.path());
  for (const std::string name : {"scan.bin", "scan.png", "folder.png", "picture.jpg", "map.btms/a.png",
                                 "new.btms/a.png", "link/a.png", "map.btms/shards/a.png", "missing/a.png"}) {
    const Outcome outcome =
        run({"build", folder_ / "scan.bin", "-o", folder_ / "new.btms", "--picture", folder_ / name});
    EXPECT_EQ(outcome.status, 2) << name << ": " << outcome.err;
    EXPECT_EQ(names_in(folder_.path()), before) << name;
  }
  EXPECT_EQ(read_text(folder_ / "scan.bin"), bytes);
  EXPECT_EQ(run({"build", folder_ / "scan.bin", "-o", folder_ / "new.btms", "--picture", folder_ / "A.PNG"}).status, 0);
  EXPECT_TRUE(fs::exists(folder_ / "A.PNG"));
}

TEST_F(CliOutput, APictureShowsTheLayerAskedFor) {
  const auto draw = [&](const std::string& layer) {
    return run({"build", folder_ / "scan.bin", "-o", folder_ / "new.btms", "--picture", folder_ / (layer + ".png"),
                "--layer", layer});
  };
  EXPECT_EQ(draw("state").status, 0);
  EXPECT_EQ(draw("cost").status, 0);
  EXPECT_NE(read_text(folder_ / "cost.png"), read_text(folder_ / "state.png"));
  const Outcome wrong = draw("beauty");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("clearance"), std::string::npos) << wrong.err;
  EXPECT_EQ(run({"build", folder_ / "scan.bin", "-o", folder_ / "new.btms", "--layer", "cost"}).status, 2);
}

TEST_F(CliOutput, LabelsOfOthersAreReplacedByForceOnly) {
  fs::create_directories(folder_ / "out");
  write_scan(folder_ / "a.bin", floor_and_wall());
  for (const std::vector<std::string>& call :
       {std::vector<std::string>{"label", map(), folder_ / "a.bin", folder_ / "scan.bin", "-o", folder_ / "out"},
        std::vector<std::string>{"segment", folder_ / "a.bin", folder_ / "scan.bin", "-o", folder_ / "out"}}) {
    fs::remove(folder_ / "out/a.label");
    write_text(folder_ / "out/scan.label", "truth");
    const Outcome refused = run(call);
    EXPECT_EQ(refused.status, 2) << refused.err;
    EXPECT_NE(refused.err.find("scan.label"), std::string::npos) << refused.err;
    EXPECT_EQ(read_text(folder_ / "out/scan.label"), "truth");
    EXPECT_FALSE(fs::exists(folder_ / "out/a.label"));
    auto forced = call;
    forced.emplace_back("--force");
    EXPECT_EQ(run(forced).status, 0);
    EXPECT_GT(fs::file_size(folder_ / "out/scan.label"), 1000u);
  }
}

TEST_F(CliOutput, SynthReplacesByForceOnly) {
  const std::vector<std::string> call = {"synth", "--points", "100000", "--files", "2", "-o", folder_ / "world"};
  EXPECT_EQ(run(call).status, 0);
  fs::remove(folder_ / "world/city_000.las");
  const Outcome refused = run(call);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("city_001.las"), std::string::npos) << refused.err;
  EXPECT_EQ(names_in(folder_ / "world"), std::vector<std::string>{"city_001.las"});
  auto forced = call;
  forced.emplace_back("--force");
  EXPECT_EQ(run(forced).status, 0);
}

TEST_F(CliOutput, TheMapOfAnotherPlaceLabelsNothing) {
  auto points = floor_and_wall();
  for (auto& p : points) p[0] += 5000;
  write_scan(folder_ / "far.bin", points);
  const Outcome far = run({"label", map(), folder_ / "far.bin", "-o", folder_ / "out"});
  EXPECT_EQ(far.status, 3) << far.err;
  EXPECT_TRUE(names_in(folder_ / "out").empty());

  for (std::size_t i = 0; i < points.size() / 3; ++i) points[i][0] -= 5000;
  write_scan(folder_ / "partly.bin", points);
  const auto partly = run_json({"label", map(), folder_ / "partly.bin", "-o", folder_ / "out"});
  ASSERT_EQ(partly["warnings"].size(), 1u) << partly;
  EXPECT_NE(partly["warnings"][0].get<std::string>().find("66.6"), std::string::npos) << partly["warnings"];
  EXPECT_TRUE(run_json({"label", map(), folder_ / "scan.bin", "-o", folder_ / "out"})["warnings"].empty());
}

}  // namespace
}  // namespace btms::test
