// A small city from synthesis to scores, through the real program.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

// One city, one map, shared by the tests of this file.
class CliRoundTrip : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    synth_ =
        run_json({"synth", "--points", "200000", "--files", "2", "--origin", "500,-300", "-o", *folder_ / "truth"});
    build_ = run_json({"build", *folder_ / "truth", "-o", map(), "--picture", *folder_ / "city.png"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string map() { return *folder_ / "city.btms"; }
  static std::string in(const std::string& name) { return *folder_ / name; }

  static inline std::unique_ptr<TempFolder> folder_;
  static inline nlohmann::json synth_, build_;
};

TEST_F(CliRoundTrip, BuildReportsWhatItDid) {
  ASSERT_TRUE(build_.is_object());
  EXPECT_EQ(build_["points"], synth_["points"]);
  EXPECT_EQ(build_["inputs"].size(), 2u);
  EXPECT_EQ(build_["preset"], "city");
  EXPECT_EQ(build_["digest"].get<std::string>().size(), 32u);
  EXPECT_GT(build_["nodes"]["observed"], 100);
  EXPECT_GT(build_["components"]["kept"], 0);
  EXPECT_FALSE(build_["phases"].empty());
  EXPECT_GT(build_["peak_rss_bytes"], 1 << 20);
  EXPECT_GT(fs::file_size(in("city.png")), 1000u);
}

TEST_F(CliRoundTrip, DigestIsTheSameForEveryWayToBuild) {
  const std::string digest = build_["digest"];
  const Outcome recomputed = run({"digest", map()});
  EXPECT_EQ(recomputed.status, 0) << recomputed.err;
  EXPECT_EQ(recomputed.out, digest + "\n");
  const std::vector<std::vector<std::string>> ways = {{"--executor", "serial"},
                                                      {"--executor", "ranks:3"},
                                                      {"--executor", "ranks:3", "--tile-cells", "7"},
                                                      {"--tile-cells", "whole"},
                                                      {"--tile-cells", "7"},
                                                      {"--neighbours", "lattice"},
                                                      {"--threads", "3"},
                                                      {"--executor", "ranks:2", "-j", "4"}};
  for (std::size_t i = 0; i < ways.size(); ++i) {
    std::vector<std::string> call = {"build", in("truth/city_001.las"), in("truth/city_000.las"), "-o",
                                     in("other.btms")};
    call.insert(call.end(), ways[i].begin(), ways[i].end());
    EXPECT_EQ(run_json(call)["digest"], digest) << testing::PrintToString(ways[i]);
    EXPECT_EQ(run_json({"digest", in("other.btms")})["match"], true) << testing::PrintToString(ways[i]);
  }
}

TEST_F(CliRoundTrip, LabelsScoreWell) {
  const auto label = run_json({"label", map(), in("truth"), "-o", in("labelled")});
  EXPECT_EQ(names_in(in("labelled")), (std::vector<std::string>{"city_000.las", "city_001.las"}));
  EXPECT_EQ(label["total"]["points"], synth_["points"]);
  EXPECT_EQ(label["total"]["terrain"].get<int>() + label["total"]["obstacle"].get<int>() +
                label["total"]["below"].get<int>() + label["total"]["dropped"].get<int>(),
            synth_["points"].get<int>());
  const auto eval = run_json({"eval", "--truth", in("truth"), "--prediction", in("labelled")});
  EXPECT_EQ(eval["files"].size(), 2u);
  EXPECT_GT(eval["with_ambiguous"]["mean"]["f1"], 0.9);
  EXPECT_LE(eval["with_ambiguous"]["mean"]["f1"], 1.0);
  const Outcome text = run({"eval", "--truth", in("truth"), "--prediction", in("labelled"), "--classes"});
  EXPECT_NE(text.out.find("deviation"), std::string::npos);
  EXPECT_NE(text.out.find("kappa"), std::string::npos);
  // A folder may meet a single file.
  EXPECT_EQ(run_json({"eval", "--truth", in("truth/city_001.las"), "--prediction", in("labelled")})["files"][0]["name"],
            "city_001");
  // Truth against itself is perfect.
  EXPECT_EQ(run_json({"eval", "--truth", in("truth/city_000.las"), "--prediction",
                      in("truth/city_000.las")})["with_ambiguous"]["pooled"]["f1"],
            1.0);
}

TEST_F(CliRoundTrip, APictureShowsWhatIsWrong) {
  run_json({"label", map(), in("truth"), "-o", in("drawn")});
  const std::vector<std::string> call = {"eval", "--truth", in("truth"), "--prediction", in("drawn")};
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> all = call;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const auto plain = run_json(call);
  EXPECT_EQ(run_json(with({"--picture", in("wrong.png")})), plain);
  EXPECT_EQ(read_text(in("wrong.png")).substr(1, 3), "PNG");
  EXPECT_EQ(run_json(with({"--picture", in("crop.png"), "--picture-box", "520,-280,560,-250"})), plain);
  EXPECT_NE(read_text(in("crop.png")), read_text(in("wrong.png")));
  // Truth against itself has nothing wrong in it.
  run_json({"eval", "--truth", in("truth"), "--prediction", in("truth"), "--picture", in("right.png")});
  EXPECT_NE(read_text(in("right.png")), read_text(in("wrong.png")));

  fs::create_hard_link(in("truth/city_000.las"), in("truth.png"));
  fs::create_hard_link(in("drawn/city_001.las"), in("drawn.png"));
  const std::string truth = read_text(in("truth.png")), drawn = read_text(in("drawn.png"));
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{"--picture", in("truth.png")},
                                             {"--picture", in("drawn.png")},
                                             {"--picture", in("wrong.jpg")},
                                             {"--picture", in("city.btms/wrong.png")},
                                             {"--picture-box", "0,0,1,1"},
                                             {"--picture", in("no.png"), "--picture-box", "0,0,1"},
                                             {"--picture", in("no.png"), "--picture-box", "0,0,0,1"},
                                             {"--picture", in("no.png"), "--picture-box", "0,0,nan,1"},
                                             {"--picture", in("no.png"), "--picture-box", "0,0,1e300,1"}})
    EXPECT_EQ(run(with(more)).status, 2) << testing::PrintToString(more);
  EXPECT_EQ(run(with({"--picture", in("no.png"), "--picture-box=-900,-900,-800,-800"})).status, 3);
  EXPECT_EQ(run({"eval", "--map", map(), "--scene", "city", "--picture", in("no.png")}).status, 2);
  EXPECT_FALSE(fs::exists(in("no.png")));
  EXPECT_EQ(read_text(in("truth.png")), truth);
  EXPECT_EQ(read_text(in("drawn.png")), drawn);
}

TEST_F(CliRoundTrip, TheMapIsScoredAgainstItsScene) {
  const std::vector<std::string> call = {"eval",   "--map",    map(),      "--scene",   "city", "--points",
                                         "200000", "--origin", "500,-300", "--spacing", "0.9"};
  const auto eval = run_json(call);
  const double edge = synth_["width_m"];
  EXPECT_NEAR(eval["all"]["places"].get<double>(), edge * edge / 0.81, 3000);  // those at steps are apart
  EXPECT_GT(eval["all"]["complete"], 0.999);
  EXPECT_LT(eval["strata"]["open"]["rmse_m"], 0.3);
  EXPECT_LT(eval["strata"]["open"]["mae_m"], eval["strata"]["open"]["rmse_m"]);
  std::size_t places = 0, of_states = 0;
  for (const auto& [name, stratum] : eval["strata"].items()) places += stratum["places"].get<std::size_t>();
  for (const auto& [name, state] : eval["all"]["states"].items()) of_states += state["places"].get<std::size_t>();
  EXPECT_EQ(places, eval["all"]["places"]);
  EXPECT_EQ(of_states, eval["all"]["known"]);
  std::vector<std::string> serial = call, text = call, elsewhere = call;
  serial.insert(serial.end(), {"-j", "1"});
  EXPECT_EQ(run_json(serial), eval);
  const Outcome table = run(call);
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_NE(table.out.find("under a building"), std::string::npos);
  // Another world's terrain is another matter, and so is a place without a map.
  elsewhere.insert(elsewhere.end(), {"--seed", "2"});
  EXPECT_GT(run_json(elsewhere)["all"]["rmse_m"], 0.5);
  const auto outside = run_json({"eval", "--map", map(), "--scene", "city", "--points", "9000", "--origin", "9000,0"});
  EXPECT_EQ(outside["all"]["complete"], 0.0);
  EXPECT_TRUE(outside["all"]["rmse_m"].is_null());
}

TEST_F(CliRoundTrip, EvalWantsOneKindOfTruth) {
  EXPECT_EQ(run({"eval"}).status, 2);
  EXPECT_EQ(run({"eval", "--map", map()}).status, 2);
  EXPECT_EQ(run({"eval", "--scene", "city"}).status, 2);
  EXPECT_EQ(run({"eval", "--truth", in("truth")}).status, 2);
  EXPECT_EQ(run({"eval", "--map", map(), "--scene", "atlantis"}).status, 2);
  EXPECT_EQ(run({"eval", "--map", map(), "--scene", "city", "--truth", in("truth")}).status, 2);
  const Outcome path = run({"eval", "--map", map(), "--scene", "city", "--points", in("truth")});
  EXPECT_EQ(path.status, 2);
  EXPECT_NE(path.err.find("synth"), std::string::npos);
}

TEST_F(CliRoundTrip, InfoNamesPointFilesAndMaps) {
  const auto file = run_json({"info", in("truth/city_000.las")});
  EXPECT_EQ(file["kind"], "points");
  EXPECT_EQ(file["points"], synth_["files"][0]["points"]);
  const auto map_info = run_json({"info", map()});
  EXPECT_EQ(map_info["kind"], "map");
  EXPECT_EQ(map_info["digest"], build_["digest"]);
  EXPECT_EQ(map_info["parameters"], build_["parameters"]);
  EXPECT_EQ(map_info["nodes"]["observed"], build_["nodes"]["observed"]);
  EXPECT_GT(map_info["upper"]["detached"], 0) << "the city has no roofs";
  EXPECT_NE(run({"info", map()}).out.find(" detached nodes of further surfaces"), std::string::npos);
  const double edge = map_info["resolution_m"], west = map_info["bounds_m"][0], east = map_info["bounds_m"][2];
  EXPECT_NEAR(west, 500, 50 * edge);  // the data and its rim, not whole tiles
  EXPECT_NEAR(east, 500 + synth_["width_m"].get<double>(), 50 * edge);
  EXPECT_LT(map_info["heights_m"][0], map_info["heights_m"][1]);
  EXPECT_NE(run({"info", map()}).out.find("resolution_m"), std::string::npos);
  run_json({"synth", "--points", "5000", "--crs", "EPSG:25832", "-o", in("utm")});
  EXPECT_NE(run({"info", in("utm/city.las")}).out.find("ETRS89 / UTM zone 32N (EPSG:25832)"), std::string::npos);
}

TEST_F(CliRoundTrip, InfoMeasuresWhatDeclaresNoExtent) {
  write_scan(in("scan.bin"), {{-1.5f, 2, 0}, {3, 4, 1}, {3.25f, 4.5f, -2}});
  const auto scan = run_json({"info", in("scan.bin")});
  EXPECT_EQ(scan["bounds_m"], nlohmann::json({-1.5, 2, -2, 3.25, 4.5, 1}));
  EXPECT_EQ(scan["points_per_m2"], 1.5);  // three points in two squares
}

TEST_F(CliRoundTrip, QueryAnswersByOptionAndInBatch) {
  const double x = 500 + synth_["width_m"].get<double>() / 2, y = -300 + synth_["height_m"].get<double>() / 2;
  const std::string place = std::to_string(x) + "," + std::to_string(y);
  const auto one = run_json({"query", map(), "--at", place});
  ASSERT_TRUE(one.contains("z"));
  EXPECT_NE(one["state"], "unknown");
  EXPECT_GT(one["normal"][2], 0.5);
  EXPECT_GE(one["step"], 0);
  EXPECT_EQ(one["source_resolution"], 2);
  EXPECT_TRUE(one["cost"].is_null() || (one["cost"] >= 0 && one["cost"] <= 1)) << one["cost"];
  EXPECT_TRUE(one["upper"].is_array());
  const auto two = run_json({"query", map(), "--at", place, "--at=-9000,-9000"});
  EXPECT_EQ(two["places"][0], one);
  EXPECT_EQ(two["places"][1]["state"], "outside");
  for (const auto& [key, value] : one.items()) EXPECT_TRUE(two["places"][1].contains(key)) << key;
  for (const char* key : {"z", "sd", "normal", "weight", "support", "step", "cost", "clearance"})
    EXPECT_TRUE(two["places"][1][key].is_null()) << key;
  EXPECT_EQ(run_json({"query", map(), "--at=1e300,0"})["state"], "outside");
  const Outcome bad = run({"query", map(), "--at", place, "--at", "oops"});
  EXPECT_EQ(bad.status, 2);
  EXPECT_EQ(bad.out, "");
  const auto batch = run_json({"query", map()}, std::to_string(x) + " " + std::to_string(y) + "\n\n-9000 -9000\n");
  EXPECT_EQ(batch["places"], two["places"]);
  EXPECT_EQ(run({"query", map()}, "1 2\nfoo\n").status, 2);
  EXPECT_NE(run({"query", map(), "--at", place}).out.find(one["state"].get<std::string>()), std::string::npos);
}

TEST_F(CliRoundTrip, QueryAlongALine) {
  const double x = 500 + synth_["width_m"].get<double>() / 2, y = -300 + synth_["height_m"].get<double>() / 2;
  const std::string a = std::to_string(x) + "," + std::to_string(y),
                    b = std::to_string(x + 6) + "," + std::to_string(y);
  const std::vector<std::string> line = {"query", map(), "--at", a, "--at", b};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), line.begin(), line.end());
    return more;
  };
  const auto profile = run_json(with({"--profile", "2.5"}))["profile"];
  ASSERT_EQ(profile.size(), 4u);
  EXPECT_EQ(profile[2][0], 5);
  EXPECT_EQ(profile[0][1], run_json({"query", map(), "--at", a})["z"]);
  EXPECT_EQ(profile[3][1], run_json({"query", map(), "--at", b})["z"]);
  EXPECT_NE(run(with({"--profile", "0"})).out.find("\n6.000 "), std::string::npos);

  // What nobody can pass, and what everybody can but an obstacle.
  const auto never = run_json(with({"--check", "4,2", "--vehicle-height-m", "1e5", "--vehicle-max-slope-deg", "0"}));
  EXPECT_EQ(never["is_safe"], false);
  EXPECT_TRUE(never["first_bad"]["reason"].is_string());
  EXPECT_NE(run(with({"--check", "4,2", "--vehicle-max-slope-deg", "0"})).out.find("not safe: "), std::string::npos);
  const auto outside = run_json({"query", map(), "--at=-9000,-9000", "--check", "4,2"});
  EXPECT_EQ(outside["first_bad"]["reason"], "outside");
  const auto explorer = run_json({"query", map(), "--at=-9000,-9000", "--check", "4,2", "--unknown-is-safe"});
  EXPECT_EQ(explorer["is_safe"], true);
  EXPECT_EQ(explorer["traversability"], 1);
  EXPECT_TRUE(explorer["first_bad"].is_null());
  for (const char* size : {"4", "0,1", "-1,2", "nan,2", "4,1e9"})
    EXPECT_EQ(run(with({std::string("--check=") + size})).status, 2) << size;
  EXPECT_EQ(run(with({"--profile", "1", "--check", "4,2"})).status, 2);
  EXPECT_EQ(run(with({"--profile", "nan"})).status, 2);
  EXPECT_EQ(run(with({"--unknown-is-safe"})).status, 2);
}

TEST_F(CliRoundTrip, QueryNamesTheKindOfFurtherSurfaces) {
  const double width = synth_["width_m"], height = synth_["height_m"];
  std::string places;
  for (int i = 0; i < 400; ++i)
    places += std::to_string(500 + (i % 20 + 0.5) * width / 20) + " " +
              std::to_string(-300 + (i / 20 + 0.5) * height / 20) + "\n";
  const auto json = run_json({"query", map()}, places);
  std::istringstream text(run({"query", map()}, places).out);
  std::string line;
  std::getline(text, line);  // what the columns are
  std::size_t listed = 0;
  for (const auto& place : json["places"]) {
    std::getline(text, line);
    std::istringstream uppers(line.substr(line.rfind(' ') + 1));
    for (const auto& upper : place["upper"]) {
      std::string one;
      std::getline(uppers, one, ',');
      const auto colon = one.find(':');
      ASSERT_NE(colon, std::string::npos) << line;
      EXPECT_NEAR(std::stod(one), upper["z"].get<double>(), 0.001);
      EXPECT_EQ(one.substr(colon + 1), upper["kind"].get<std::string>());
      ++listed;
    }
  }
  EXPECT_GT(listed, 0u);
}

TEST_F(CliRoundTrip, EqualOutputNamesAndOverwrittenInputsAreRefused) {
  fs::create_directories(in("copy"));
  fs::copy_file(in("truth/city_000.las"), in("copy/city_000.las"), fs::copy_options::overwrite_existing);
  const Outcome equal = run({"label", map(), in("truth/city_000.las"), in("copy/city_000.las"), "-o", in("equal")});
  EXPECT_EQ(equal.status, 2) << equal.err;
  EXPECT_FALSE(fs::exists(in("equal")));
  const std::string before = read_text(in("copy/city_000.las"));
  const Outcome onto = run({"label", map(), in("copy/city_000.las"), "-o", in("copy")});
  EXPECT_EQ(onto.status, 2) << onto.err;
  EXPECT_EQ(read_text(in("copy/city_000.las")), before);
}

TEST_F(CliRoundTrip, ADamagedMapFailsVerification) {
  fs::remove_all(in("damaged.btms"));
  fs::copy(map(), in("damaged.btms"), fs::copy_options::recursive);
  fs::path largest;
  for (const auto& entry : fs::recursive_directory_iterator(in("damaged.btms")))
    if (entry.is_regular_file() && entry.path().filename() != "map.nc" &&
        (largest.empty() || entry.file_size() > fs::file_size(largest)))
      largest = entry.path();
  std::string bytes = read_text(largest);
  for (std::size_t i = bytes.size() / 4; i < bytes.size() * 3 / 4; ++i) bytes[i] = static_cast<char>(bytes[i] ^ 0x55);
  write_text(largest, bytes);
  EXPECT_EQ(run({"digest", in("damaged.btms")}).status, 4) << largest;
}

TEST_F(CliRoundTrip, ProgressAsJsonIsOneObjectALine) {
  const Outcome outcome = run({"digest", map(), "--progress", "json"});
  std::istringstream lines(outcome.err);
  int objects = 0;
  for (std::string line; std::getline(lines, line); ++objects)
    EXPECT_TRUE(nlohmann::json::parse(line, nullptr, false).contains("phase")) << line;
  EXPECT_GE(objects, 1);
}

}  // namespace
}  // namespace btms::test
