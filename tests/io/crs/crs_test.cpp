#include "io/crs/crs.h"

#include "tests/io/store/made_map.h"

namespace btms {
namespace {

TEST(Crs, KeepsTheEpsgCode) {
  for (const char* code : {"28992", "25832", "7415", "4326", "2263"}) {
    const std::string wkt = normalise_crs(std::string("EPSG:") + code);
    EXPECT_TRUE(wkt.ends_with(std::string("ID[\"EPSG\",") + code + "]]")) << wkt;
    EXPECT_EQ(wkt.find('\n'), std::string::npos);
    EXPECT_EQ(normalise_crs(wkt), wkt);
  }
  EXPECT_EQ(normalise_crs(""), "");
}

TEST(Crs, TransverseMercatorHasItsCfParameters) {
  const Crs crs = describe_crs("EPSG:25832");
  EXPECT_EQ(crs.grid_mapping_name, "transverse_mercator");
  const std::map<std::string, double> p(crs.parameters.begin(), crs.parameters.end());
  EXPECT_DOUBLE_EQ(p.at("longitude_of_central_meridian"), 9);
  EXPECT_DOUBLE_EQ(p.at("latitude_of_projection_origin"), 0);
  EXPECT_DOUBLE_EQ(p.at("scale_factor_at_central_meridian"), 0.9996);
  EXPECT_DOUBLE_EQ(p.at("false_easting"), 500000);
  EXPECT_DOUBLE_EQ(p.at("false_northing"), 0);
  EXPECT_DOUBLE_EQ(p.at("semi_major_axis"), 6378137);
  EXPECT_NEAR(p.at("inverse_flattening"), 298.257222101, 1e-9);
}

TEST(Crs, UnitsAndKinds) {
  EXPECT_EQ(describe_crs("EPSG:28992").linear_unit_m, 1);
  EXPECT_FALSE(describe_crs("EPSG:28992").is_geographic);
  EXPECT_EQ(describe_crs("EPSG:28992").grid_mapping_name, "");  // the double stereographic is not in CF
  EXPECT_NEAR(describe_crs("EPSG:2263").linear_unit_m, 0.3048006096, 1e-10);
  EXPECT_TRUE(describe_crs("EPSG:4326").is_geographic);
  EXPECT_EQ(describe_crs("EPSG:25832").height_standard_name, "");
  EXPECT_EQ(describe_crs("EPSG:7415").height_standard_name, "surface_altitude");
}

TEST(Crs, UnitOfHeights) {
  EXPECT_EQ(describe_crs("EPSG:25832").vertical_unit_m, 0);
  EXPECT_EQ(describe_crs("EPSG:7415").vertical_unit_m, 1);
  EXPECT_NEAR(describe_crs("EPSG:2263+6360").vertical_unit_m, 0.3048006096, 1e-10);
  EXPECT_EQ(describe_crs("EPSG:4979").vertical_unit_m, 1);
}

TEST(Crs, ReadsWkt1) {
  const char* kWkt1 =
      R"(PROJCS["x",GEOGCS["ETRS89",DATUM["European_Terrestrial_Reference_System_1989",SPHEROID["GRS 1980",6378137,298.257222101]],)"
      R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],)"
      R"(PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],)"
      R"(PARAMETER["false_northing",0],UNIT["metre",1],AUTHORITY["EPSG","25832"]])";
  const Crs crs = describe_crs(kWkt1);
  EXPECT_TRUE(crs.wkt.starts_with("PROJCRS["));
  EXPECT_TRUE(crs.wkt.ends_with("ID[\"EPSG\",25832]]")) << crs.wkt;
  EXPECT_EQ(crs.grid_mapping_name, "transverse_mercator");
}

TEST(Crs, RefusesWhatIsNone) {
  EXPECT_EQ(thrown_code([] { describe_crs("EPSG:99999999"); }), ErrorCode::kUsage);
  EXPECT_EQ(thrown_code([] { describe_crs("banana"); }), ErrorCode::kUsage);
  EXPECT_EQ(thrown_code([] { describe_crs("EPSG:5709"); }), ErrorCode::kUsage);  // heights only
  EXPECT_EQ(thrown_code([] { describe_crs("PROJCS[\"x\",["); }), ErrorCode::kBadInput);
  EXPECT_EQ(thrown_code([] { describe_crs("+proj=pipeline +step +proj=utm +zone=32"); }), ErrorCode::kUsage);
}

}  // namespace
}  // namespace btms
