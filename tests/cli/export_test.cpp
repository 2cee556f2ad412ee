// btms export: what others read is what `btms query` answers.
#include <cmath>
#include <cstdio>
#include <cstring>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

using Json = nlohmann::json;

class CliExport : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--points", "150000", "-o", file("truth")});
    run_json({"build", file("truth"), "-o", map(), "--crs", "EPSG:25832"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string file(const std::string& name) { return *folder_ / name; }
  static std::string map() { return file("city.btms"); }

  // What queries answer at the centres of the squares, from the north-west on.
  static std::vector<float> queried(const Json& exported) {
    const double cell_m = exported["cell_m"];
    std::ostringstream places;
    places.precision(17);
    for (int row = 0; row < exported["rows"]; ++row)
      for (int col = 0; col < exported["cols"]; ++col)
        places << exported["bounds"][0].get<double>() + (col + 0.5) * cell_m << " "
               << exported["bounds"][3].get<double>() - (row + 0.5) * cell_m << "\n";
    const Json answers = run_json({"query", map()}, places.str())["places"];
    std::vector<float> heights;
    for (const Json& a : answers) heights.push_back(a["z"].is_null() ? NAN : static_cast<float>(a["z"].get<double>()));
    return heights;
  }

  static std::vector<float> floats_at_the_end(const std::string& path, std::size_t n) {
    const std::string bytes = read_text(path);
    std::vector<float> values(n);
    if (bytes.size() < n * sizeof(float)) return {};
    std::memcpy(values.data(), bytes.data() + bytes.size() - n * sizeof(float), n * sizeof(float));
    return values;
  }

  static void expect_same(const std::vector<float>& found, const std::vector<float>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    std::size_t known = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_TRUE(found[i] == expected[i] || (std::isnan(found[i]) && std::isnan(expected[i])))
          << i << ": " << found[i] << " " << expected[i];
      known += !std::isnan(found[i]);
    }
    EXPECT_GT(known, found.size() / 4);
  }

  static inline std::unique_ptr<TempFolder> folder_;
};

TEST_F(CliExport, ArraysHaveTheHeightsOfQueries) {
  int n = 0;
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--bbox", "30,20,90,71"},
                                                  {"--level", "3"},
                                                  {"--res", "3.1", "--bbox", "11,12,99,77"}}) {
    const std::string path = file("a" + std::to_string(n++) + ".npy");
    std::vector<std::string> arguments = {"export", map(), "-o", path};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Json exported = run_json(arguments);
    const std::size_t squares = exported["rows"].get<std::size_t>() * exported["cols"].get<std::size_t>();
    expect_same(floats_at_the_end(path, squares), queried(exported));
  }
}

TEST_F(CliExport, BoxesAreWholeSquaresAndNoneMore) {
  const auto bounds = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"export", map(), "-o", file("b.npy"), "--force"});
    return run_json(options)["bounds"];
  };
  EXPECT_EQ(bounds({"--bbox", "30,20,90,72"}), Json({30.0, 20.0, 90.0, 72.0}));
  EXPECT_EQ(bounds({"--bbox", "30.1,19.9,89.9,72.1"}), Json({30.0, 18.0, 90.0, 74.0}));
  EXPECT_EQ(bounds({"--bbox", "30,20,90,72", "--level", "2"}), Json({24.0, 16.0, 96.0, 72.0}));
  EXPECT_EQ(bounds({"--bbox", "30,20,90,72", "--res", "0.5"}), Json({30.0, 20.0, 90.0, 72.0}));
}

TEST_F(CliExport, GdalOpensGeoTiffs) {
  if (std::system("/usr/bin/python3 -c 'import osgeo' 2>/dev/null") != 0 ||
      std::system("command -v gdal_translate gdaldem gdalwarp > /dev/null") != 0)
    GTEST_SKIP() << "python3-gdal or gdal-bin is not installed";
  const Json plain = run_json({"export", map(), "-o", file("c.tif"), "--layers", "elevation,class"});
  run_json({"export", map(), "-o", file("cog.tif"), "--cog"});
  EXPECT_FALSE(fs::exists(file("cog.tif.plain.tif")));
  const std::string script = std::string(BTMS_SOURCE_DIR) + "/tests/io/export/read_geotiff.py ";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(
      popen(("/usr/bin/python3 " + script + file("c.tif") + " " + file("cog.tif")).c_str(), "r"), pclose);
  std::array<char, 65536> line{};
  std::vector<Json> found;
  while (std::fgets(line.data(), line.size(), pipe.get())) found.push_back(Json::parse(line.data()));
  ASSERT_EQ(found.size(), 2u);
  for (const Json& f : found) {
    EXPECT_EQ(f["size"], Json({plain["cols"], plain["rows"]}));
    EXPECT_EQ(f["frame"], Json({plain["bounds"][0], 2.0, 0.0, plain["bounds"][3], 0.0, -2.0}));
    EXPECT_EQ(f["epsg"], "25832");
    EXPECT_EQ(f["nodata"][0], "nan");
  }
  EXPECT_EQ(found[0]["names"], Json({"elevation", "class"}));
  EXPECT_EQ(found[1]["structure"]["LAYOUT"], "COG");
  const std::size_t squares = plain["rows"].get<std::size_t>() * plain["cols"].get<std::size_t>();
  const std::vector<float> expected = queried(plain);
  std::vector<float> both = floats_at_the_end(file("c.tif.f32"), 2 * squares);
  both.resize(squares);
  expect_same(both, expected);
  expect_same(floats_at_the_end(file("cog.tif.f32"), squares), expected);
  for (const std::string& command : {"gdaldem slope -q " + file("c.tif") + " " + file("slope.tif"),
                                     "gdalwarp -q -t_srs EPSG:4326 " + file("c.tif") + " " + file("w.tif")})
    EXPECT_EQ(std::system((command + " > /dev/null").c_str()), 0) << command;
}

TEST_F(CliExport, AMapForNav2IsTwoFiles) {
  const Json exported = run_json({"export", map(), "-o", file("nav.yaml"), "--res", "0.5", "--inflation", "1"});
  const std::string yaml = read_text(file("nav.yaml")), pgm = read_text(file("nav.pgm"));
  EXPECT_NE(yaml.find("image: nav.pgm\n"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("resolution: 0.5\n"), std::string::npos) << yaml;
  const std::string head = "P5\n" + exported["cols"].dump() + " " + exported["rows"].dump() + "\n255\n";
  EXPECT_TRUE(pgm.starts_with(head));
  EXPECT_EQ(pgm.size(), head.size() + exported["cols"].get<std::size_t>() * exported["rows"].get<std::size_t>());
}

TEST_F(CliExport, MistakesAreNamedAndNothingIsWritten) {
  const auto refused = [&](std::vector<std::string> options, const std::string& name, const char* why) {
    options.insert(options.begin(), {"export", map(), "-o", file(name)});
    const Outcome outcome = run(options);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(file(name)));
  };
  refused({}, "x.doc", "Names end in");
  refused({"--layers", "elevation,depth"}, "x.tif", "no layer 'depth'");
  refused({"--layers", "slope,slope"}, "x.tif", "twice");
  refused({"--layers", "slope,cost"}, "x.png", "one layer");
  refused({"--bbox", "3,3,1,9"}, "x.tif", "empty");
  refused({"--bbox", "1e5,3,2e5,9"}, "x.tif", "where the map is not");
  refused({"--bbox", "-1e18,3,50,9"}, "x.tif", "beyond the coordinates");
  refused({"--res", "0"}, "x.tif", "0.001");
  refused({"--res", "0.002"}, "x.npy", "larger squares");
  refused({"--cog"}, "x.npy", "--cog");
  refused({"--res", "1"}, "x.glb", "--level");
  refused({"--level", "1"}, "x.graph", "--level");
  refused({"--tile-m", "21"}, "x.pcd", "whole squares");
  refused({"--res", "0.501"}, "x.nc", "even number of millimetres");
  write_text(file("there.tif"), "mine");
  EXPECT_EQ(run({"export", map(), "-o", file("there.tif")}).status, 2);
  EXPECT_EQ(read_text(file("there.tif")), "mine");
}

}  // namespace
}  // namespace btms::test
