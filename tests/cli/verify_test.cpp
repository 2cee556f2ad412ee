// verify, its repair, and diff, through the real program.
#include <gmock/gmock.h>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

using testing::HasSubstr;

class CliVerify : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--points", "150000", "--files", "2", "-o", *folder_ / "city"});
    build(*folder_ / "pristine.btms");
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static nlohmann::json build(const std::string& map, const std::vector<std::string>& more = {}) {
    std::vector<std::string> call = {"build", in("city"), "-o", map, "--tile-cells", "3", "--crs", "EPSG:28992"};
    call.insert(call.end(), more.begin(), more.end());
    return run_json(call);
  }
  static std::string in(const std::string& name) { return *folder_ / name; }

  void SetUp() override {
    fs::remove_all(map_);
    fs::copy(in("pristine.btms"), map_, fs::copy_options::recursive);
    shards_ = names_in(map_ / "shards");
    ASSERT_GE(shards_.size(), 4u);
  }
  void flip(const fs::path& file, std::size_t at) const {
    std::string bytes = read_text(file);
    bytes.at(at) = static_cast<char>(bytes.at(at) ^ 2);
    write_text(file, bytes);
  }
  static std::map<std::string, std::string> files(const fs::path& map) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(map))
      if (entry.is_regular_file()) all[fs::relative(entry.path(), map)] = read_text(entry.path());
    return all;
  }

  static inline std::unique_ptr<TempFolder> folder_;
  const fs::path map_ = in("map.btms");
  std::vector<std::string> shards_;
};

TEST_F(CliVerify, ASoundMapIsSound) {
  for (const std::vector<std::string>& way :
       {std::vector<std::string>{}, {"--untrusted"}, {"--threads", "1"}, {"--repair"}}) {
    std::vector<std::string> call = {"verify", map_};
    call.insert(call.end(), way.begin(), way.end());
    const auto json = run_json(call);
    EXPECT_EQ(json["sound"], true) << json;
    EXPECT_EQ(json["shards"], shards_.size());
    EXPECT_TRUE(json["problems"].empty());
  }
  const Outcome text = run({"verify", map_, "-q"});
  EXPECT_EQ(text.status, 0);
  EXPECT_THAT(text.out, HasSubstr("sound: "));
}

TEST_F(CliVerify, NamesEveryProblemOnALine) {
  flip(map_ / "shards" / shards_[0], 3000);
  fs::remove(map_ / "shards" / shards_[2]);
  flip(map_ / "map.nc", 900);
  write_text(map_ / "mine.txt", "x");
  const Outcome text = run({"verify", map_, "-q"});
  EXPECT_EQ(text.status, 4);
  for (const std::string& word :
       {"shards/" + shards_[0] + ": tile", "shards/" + shards_[2] + ": tile", std::string("map.nc: is not"),
        std::string("mine.txt: not part"), std::string("3 problems")})
    EXPECT_THAT(text.out, HasSubstr(word));
  EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '\n'), 5);
  const Outcome json = run({"verify", map_, "--untrusted", "--json", "-q"});
  EXPECT_EQ(json.status, 4);
  EXPECT_EQ(json.json()["problems"].size(), 3u);
  EXPECT_EQ(json.json()["problems"][0]["tiles"].size(), 1u);
  EXPECT_EQ(json.json()["stray"].size(), 1u);
}

TEST_F(CliVerify, RepairsFromTheInputsWhatItCanAndLeavesTheRestAlone) {
  const auto good = files(map_);
  fs::remove(map_ / "shards" / shards_[1]);
  write_text(map_ / "shards" / shards_[3], "rubbish");
  fs::remove(map_ / "map.nc");
  fs::rename(in("city"), in("moved"));
  const Outcome without = run({"verify", map_, "--repair", "-q"});
  EXPECT_EQ(without.status, 4);
  EXPECT_THAT(without.out, HasSubstr("map.nc: written again"));
  EXPECT_THAT(without.out,
              HasSubstr("2 shards can only be rebuilt from the map's inputs, which are not there any more"));
  // The wrong inputs: some only, and others.
  const Outcome some = run({"verify", map_, "--repair", "--inputs", in("moved/city_000.las"), "-q"});
  EXPECT_EQ(some.status, 4);
  EXPECT_THAT(some.out, HasSubstr("city_001.las too, which is not among --inputs"));
  fs::create_directory(in("other"));
  fs::copy(in("moved/city_000.las"), in("other"), fs::copy_options::overwrite_existing);
  write_text(in("other/city_001.las"), read_text(in("moved/city_000.las")));
  const Outcome other = run({"verify", map_, "--repair", "--inputs", in("other"), "-q"});
  EXPECT_EQ(other.status, 4);
  EXPECT_THAT(other.out, HasSubstr("not repaired: "));
  const Outcome repaired = run({"verify", map_, "--repair", "--inputs", in("moved"), "-q"});
  EXPECT_EQ(repaired.status, 0) << repaired.out << repaired.err;
  EXPECT_THAT(repaired.out, HasSubstr("shards/" + shards_[1] + ": rebuilt from the inputs"));
  EXPECT_EQ(files(map_), good);
  // Where they are still, the map knows.
  fs::rename(in("moved"), in("city"));
  fs::remove(map_ / "shards" / shards_[1]);
  EXPECT_EQ(run({"verify", map_, "--repair", "-q"}).status, 0);
  EXPECT_EQ(files(map_), good);
}

TEST_F(CliVerify, RebuildsMapsInOneTileAndWithATrajectory) {
  write_text(in("poses.txt"), "0 0 30\n10 0 30\n");
  const std::string whole = in("whole.btms");
  run_json({"build", in("city"), "-o", whole, "--tile-cells", "whole", "--trajectory", in("poses.txt")});
  const auto good = files(whole);
  write_text(fs::path(whole) / "shards" / names_in(fs::path(whole) / "shards")[0], "");
  const Outcome without = run({"verify", whole, "--repair", "--inputs", in("city"), "-q"});
  EXPECT_EQ(without.status, 4);
  EXPECT_THAT(without.out, HasSubstr("name it with --trajectory"));
  const Outcome repaired =
      run({"verify", whole, "--repair", "--inputs", in("city"), "--trajectory", in("poses.txt"), "-q"});
  EXPECT_EQ(repaired.status, 0) << repaired.out;
  EXPECT_EQ(files(whole), good);
}

TEST_F(CliVerify, ADamagedManifestIsSaidToBeBeyondRepair) {
  flip(map_ / "manifest.json", 200);
  EXPECT_EQ(run({"verify", map_}).status, 4);
  const Outcome outcome = run({"verify", map_, "--repair"});
  EXPECT_EQ(outcome.status, 4);
  EXPECT_THAT(outcome.err, HasSubstr("can't be repaired"));
  write_text(map_ / "manifest.json", "{}");
  EXPECT_EQ(run({"verify", map_}).status, 3);
  fs::remove(map_ / "manifest.json");
  EXPECT_EQ(run({"verify", map_}).status, 3);
  EXPECT_EQ(run({"verify", in("city")}).status, 3);
  EXPECT_EQ(run({"verify", in("nowhere")}).status, 2);
  EXPECT_EQ(run({"verify", map_, "--inputs", in("city")}).status, 2);
}

TEST_F(CliVerify, UntrustedMapsAnswerLikeTrustedOnes) {
  for (const std::vector<std::string>& call : {std::vector<std::string>{"query", map_, "--at", "3,4", "--at", "40,-20"},
                                               {"digest", map_, "-q"},
                                               {"info", map_}}) {
    std::vector<std::string> untrusted = call;
    untrusted.push_back("--untrusted");
    const Outcome expected = run(call), found = run(untrusted);
    EXPECT_EQ(found.status, 0) << found.err;
    EXPECT_EQ(found.out, expected.out);
  }
}

TEST_F(CliVerify, DiffFindsNothingInTheSameTerrainHoweverItIsCut) {
  const std::string other = in("other.btms");
  run_json({"build", in("city"), "-o", other, "--tile-cells", "whole", "--crs", "EPSG:28992", "--threads", "1"});
  const auto same = run_json({"diff", map_, other});
  EXPECT_EQ(same["equal"], true) << same;
  EXPECT_GT(same["nodes"], 10000);
  EXPECT_EQ(same["settings"].size(), 1u);
  EXPECT_EQ(same["settings"][0]["name"], "tiles");
  EXPECT_EQ(run_json({"diff", other, map_})["nodes"], same["nodes"]);
  EXPECT_EQ(run({"diff", map_, map_, "-q", "--untrusted"}).status, 0);
}

TEST_F(CliVerify, DiffSaysWhereAndHowMuch) {
  const std::string other = in("vehicle.btms");
  build(other, {"--vehicle-max-step-m", "0.05"});
  const Outcome outcome = run({"diff", map_, other, "--json", "-q"});
  EXPECT_EQ(outcome.status, 4) << outcome.err;
  const auto json = outcome.json();
  EXPECT_EQ(json["equal"], false);
  EXPECT_EQ(json["settings"][0]["name"], "vehicle_max_step_m");
  EXPECT_EQ(json["layers"].size(), 1u) << json["layers"];
  EXPECT_GT(json["layers"]["cost"]["nodes"], 10);
  EXPECT_EQ(json["layers"]["cost"]["nodes"], json["differ"]);
  EXPECT_TRUE(json["states"].empty());
  EXPECT_FALSE(json["tiles"].empty());
  EXPECT_THAT(run({"diff", map_, other, "-q"}).out, HasSubstr("nodes differ, in"));

  const std::string coarse = in("coarse.btms");
  run_json({"build", in("city"), "-o", coarse, "--resolution", "4"});
  const Outcome apart = run({"diff", map_, coarse, "-q"});
  EXPECT_EQ(apart.status, 4);
  EXPECT_THAT(apart.err, HasSubstr("can't be compared"));
  EXPECT_EQ(run({"diff", map_, in("nowhere")}).status, 2);
}

}  // namespace
}  // namespace btms::test
