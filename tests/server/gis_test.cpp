// The faces for GIS clients: EDR, and tiles of web maps.
#include <cmath>

#include "io/store/open_terrain.h"
#include "io/store/projection.h"
#include "tests/io/export/read_png.h"
#include "tests/server/served_city.h"

namespace btms::test {
namespace {

using GisAnswers = AnsweredCity;

TEST_F(GisAnswers, WebTilesHoldTheHeightsOfTheMap) {
  const nlohmann::json about = json(ask("/xyz/city.json"));
  EXPECT_EQ(about["encoding"], "terrarium");
  const int zoom = about["maxzoom"].get<int>() + 1;
  const double lon = (about["bounds"][0].get<double>() + about["bounds"][2].get<double>()) / 2;
  const double lat = (about["bounds"][1].get<double>() + about["bounds"][3].get<double>()) / 2;
  const double n = std::ldexp(1.0, zoom), pi = 3.14159265358979323846;
  const auto tx = static_cast<int>((lon + 180) / 360 * n);
  const auto ty = static_cast<int>((1 - std::asinh(std::tan(lat * pi / 180)) / pi) / 2 * n);
  const std::string target =
      "/xyz/city/" + std::to_string(zoom) + "/" + std::to_string(tx) + "/" + std::to_string(ty) + ".png";
  const Response tile = ask(target);
  ASSERT_EQ(tile.status, 200) << text(tile);
  const Picture pixels = read_png(*tile.body);
  ASSERT_EQ(pixels.width() * pixels.height(), 65536);

  const auto [reader, terrain] = open_terrain(map_path());
  const Projection projection(reader->info().crs_wkt);
  const double half = 20037508.342789244, pixel = 2 * half / n / 256;
  int compared = 0;
  for (int i = 0; i < 65536; i += 97) {
    std::vector<Place> place = {{(tx * 256 + i % 256 + 0.5) * pixel - half, half - (ty * 256 + i / 256 + 0.5) * pixel}};
    projection.mercator_to_map(place);
    const HeightAnswer height = terrain.height(place[0]);
    if (height.status != QueryStatus::kOk || height.state == NodeState::kUnknown) continue;
    const Rgb c = pixels.at(i % 256, i / 256);
    EXPECT_NEAR(c.r * 256.0 + c.g + c.b / 256.0 - 32768, height.z_m, 1.0 / 256);
    ++compared;
  }
  EXPECT_GT(compared, 300);
  Request again = get(target);
  again.headers["if-none-match"] = header(tile, "ETag");
  EXPECT_EQ(ask(again).status, 304);
  // Coarse tiles come out of coarse levels.
  const int up = zoom - 3;
  const Response coarse =
      ask("/xyz/city/" + std::to_string(up) + "/" + std::to_string(tx >> 3) + "/" + std::to_string(ty >> 3) + ".png");
  EXPECT_EQ(coarse.status, 200) << text(coarse);
}

TEST_F(GisAnswers, WebTilesThatAreNot) {
  EXPECT_EQ(ask("/xyz/city/0/0/0.jpg").status, 404);
  EXPECT_EQ(ask("/xyz/city/3/9/0.png").status, 404);
  EXPECT_EQ(ask("/xyz/city/99/0/0.png").status, 404);
  EXPECT_EQ(ask("/xyz/city/2/-1/0.png").status, 400);
  EXPECT_EQ(ask("/xyz/city/10/1/1.png").status, 404);
  EXPECT_EQ(ask("/xyz/town.json").status, 404);
}

TEST_F(GisAnswers, CoveragesHoldTheHeightsOfTheMap) {
  const Terrain terrain = open_terrain(map_path()).terrain;
  const nlohmann::json point =
      json(ask("/collections/city/position?coords=POINT(80.5%2060.25)&parameter-name=elevation,slope"));
  EXPECT_EQ(point["domain"]["domainType"], "Point");
  EXPECT_EQ(point["ranges"]["elevation"]["values"][0].get<double>(), terrain.height({80.5, 60.25}).z_m);
  EXPECT_TRUE(point["ranges"].contains("slope"));
  const nlohmann::json line = json(ask("/collections/city/trajectory?coords=LINESTRING(80%2060,90%2062,100%2064)"));
  EXPECT_EQ(line["ranges"]["elevation"]["values"][2].get<double>(), terrain.height({100, 64}).z_m);
  const nlohmann::json cube = json(ask("/collections/city/cube?bbox=80,60,90,66"));
  EXPECT_EQ(cube["ranges"]["elevation"]["shape"], nlohmann::json::array({3, 5}));
  EXPECT_EQ(cube["ranges"]["elevation"]["values"][0].get<float>(), static_cast<float>(terrain.height({81, 65}).z_m));
  const nlohmann::json area = json(ask("/collections/city/area?coords=POLYGON((80%2060,90%2060,80%2070,80%2060))"));
  EXPECT_FALSE(area["ranges"]["elevation"]["values"][20].is_null()) << "south-west";
  EXPECT_TRUE(area["ranges"]["elevation"]["values"][4].is_null()) << "north-east";
  EXPECT_EQ(json(ask("/collections"))["collections"][0]["crs"][0], "EPSG:32632");
}

TEST_F(GisAnswers, CoveragesAskedForWrongly) {
  for (const char* query :
       {"position", "position?coords=", "position?coords=POINT", "position?coords=POINT(", "position?coords=POINT(1)",
        "position?coords=POINT(1%202", "position?coords=POINT(1%202)x", "position?coords=POINT(nan%202)",
        "position?coords=POINT(1%202,3%204)", "trajectory?coords=LINESTRING(1%202)",
        "area?coords=POLYGON((1%202,3%204))", "area?coords=POLYGON(1%202,3%204,5%206,1%202)", "cube", "cube?bbox=1,2,3",
        "cube?bbox=3,3,1,1", "position?coords=POINT(1%202)&crs=EPSG:4326", "position?coords=POINT(1%202)&f=CSV",
        "position?coords=POINT(1%202)&parameter-name=gold"}) {
    const Response answer = ask(std::string("/collections/city/") + query);
    EXPECT_EQ(answer.status, 400) << query << text(answer);
  }
  EXPECT_EQ(ask("/collections/city/cube?bbox=-1e6,-1e6,1e6,1e6").status, 413);
}

}  // namespace
}  // namespace btms::test
