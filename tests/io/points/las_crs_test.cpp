#include <chrono>

#include "io/crs/crs_units.h"
#include "tests/io/points/las_bytes.h"

namespace btms::test {
namespace {

std::string wkt(const std::string& unit, const std::string& false_easting) {
  return "PROJCS[\"zone\",GEOGCS[\"ETRS89\",DATUM[\"d\",SPHEROID[\"GRS "
         "1980\",6378137,298.257222101]],PRIMEM[\"Greenwich\","
         "0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\","
         "0],"
         "PARAMETER[\"central_meridian\",9],PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\"," +
         false_easting + "],PARAMETER[\"false_northing\",0],UNIT[" + unit + "]]";
}

const std::string kMetric = wkt("\"metre\",1", "500000");
const std::string kFeet = wkt("\"foot\",0.3048", "1640419.947506562");
const std::string kDegrees =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT["
    "\"degree\",0.0174532925199433]]";

Vlr wkt_record(const std::string& text) { return {"LASF_Projection", 2112, text_bytes(text)}; }

LasSpec with(const Vlr& vlr) {
  LasSpec spec = las_spec(4, 6);
  spec.vlrs = {vlr};
  spec.xyz = {{10'000, 20'000, 30'000}};
  return spec;
}

std::unique_ptr<PointFile> opened(const TemporaryFolder& folder, const LasSpec& spec) {
  return open_points(folder.write("a.las", las_bytes(spec)));
}

TEST(LasCrs, IsTheWktAsItStands) {
  const TemporaryFolder folder;
  const auto file = opened(folder, with(wkt_record(kMetric)));
  EXPECT_EQ(file->info().crs, kMetric);
  EXPECT_TRUE(file->info().warnings.empty());
  EXPECT_EQ(read_all(*file).x_mm[0], 10'000);
}

TEST(LasCrs, ComesFromAnExtendedRecordToo) {
  const TemporaryFolder folder;
  LasSpec spec = las_spec(4, 6);
  spec.evlrs = {{"someone", 2112, text_bytes("not this")},
                wkt_record(kMetric + std::string(1, '\0') + "behind the end")};
  EXPECT_EQ(opened(folder, spec)->info().crs, kMetric);
}

TEST(LasCrs, IsAnEpsgCodeFromGeokeys) {
  const TemporaryFolder folder;
  const auto file = opened(folder, with(geokeys({{1024, 1}, {3072, 25832}, {3076, 9001}})));
  EXPECT_EQ(file->info().crs, "EPSG:25832");
  EXPECT_TRUE(file->info().warnings.empty());
}

TEST(LasCrs, PrefersWktToGeokeys) {
  const TemporaryFolder folder;
  LasSpec spec = with(geokeys({{1024, 1}, {3072, 25832}}));
  spec.vlrs.push_back(wkt_record(kMetric));
  EXPECT_EQ(opened(folder, spec)->info().crs, kMetric);
}

TEST(LasCrs, FallsBackToGeokeysWhenWktIsNonsense) {
  const TemporaryFolder folder;
  LasSpec spec = with(geokeys({{1024, 1}, {3072, 25832}}));
  spec.vlrs.push_back(wkt_record(std::string(60'000, '[')));
  const auto file = opened(folder, spec);
  EXPECT_EQ(file->info().crs, "EPSG:25832");
  expect_warning(file->info(), "WKT record cannot be understood");
}

TEST(LasCrs, IsUnknownWithoutRecords) {
  const TemporaryFolder folder;
  const auto file = opened(folder, {});
  EXPECT_EQ(file->info().crs, "");
  EXPECT_TRUE(file->info().warnings.empty());
}

TEST(LasCrs, ConvertsFeetToMetresAndSaysSo) {
  struct Case {
    const char* name;
    Vlr vlr;
    std::int64_t x_mm;
    std::int32_t z_mm;
  };
  const std::vector<Case> cases = {
      {"WKT", wkt_record(kFeet), 3048, 9144},
      {"geokey 9002", geokeys({{1024, 1}, {3072, 32767}, {3076, 9002}}), 3048, 9144},
      {"geokey 9003", geokeys({{1024, 1}, {3072, 32767}, {3076, 9003}}), 3048, 9144},
      {"heights stated in metres", geokeys({{1024, 1}, {3072, 32767}, {3076, 9002}, {4099, 9001}}), 3048, 30'000},
      {"only heights in feet", geokeys({{1024, 1}, {3072, 25832}, {3076, 9001}, {4099, 9002}}), 10'000, 9144},
      {"heights by a code in US feet", geokeys({{1024, 1}, {3072, 26910}, {4096, 6360}}), 10'000, 9144},
      {"EPSG code in US feet", geokeys({{1024, 1}, {3072, 2225}}), 3048, 9144},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const TemporaryFolder folder;
    const auto file = opened(folder, with(c.vlr));
    expect_warning(file->info(), "converted to metres");
    const PointBlock block = read_all(*file);
    EXPECT_EQ(block.x_mm[0], c.x_mm);
    EXPECT_EQ(block.z_mm[0], c.z_mm);
    ASSERT_TRUE(file->info().declared_bounds_m);
    EXPECT_NEAR((*file->info().declared_bounds_m)[3], static_cast<double>(c.x_mm) / 10, 1e-2);
  }
}

// US survey feet differ from international ones by 2 mm in a kilometre.
TEST(LasCrs, TellsTheTwoFeetApart) {
  const TemporaryFolder folder;
  LasSpec spec = with(geokeys({{1024, 1}, {3072, 32767}, {3076, 9003}}));
  spec.xyz = {{1'000'000'000, 0, 0}};
  EXPECT_EQ(read_all(*opened(folder, spec)).x_mm[0], 304'800'610);
}

TEST(LasCrs, DescribesTheConvertedCoordinates) {
  const TemporaryFolder folder;
  const std::string crs = opened(folder, with(wkt_record(kFeet)))->info().crs;
  EXPECT_NE(crs.find("500000"), std::string::npos) << crs;  // the false easting in metres
  EXPECT_NE(crs.find("metre"), std::string::npos) << crs;
  EXPECT_EQ(crs.find("foot"), std::string::npos) << crs;
}

// Such a unit would mirror heights, press them flat, or (its product with the scale 0) be divided by.
TEST(LasCrs, RefusesUnitsThatNothingIsMeasuredIn) {
  for (const char* unit : {"-1", "5e-324", "1e300"}) {
    SCOPED_TRACE(unit);
    const std::string heights = std::string("VERT_CS[\"h\",VERT_DATUM[\"v\",2005],UNIT[\"u\",") + unit + "]]";
    LasSpec spec = with(wkt_record("COMPD_CS[\"c\"," + kMetric + "," + heights + "]"));
    spec.scale = {0.001, 0.001, 1e-9};
    const TemporaryFolder folder;
    const auto file = opened(folder, spec);
    expect_warning(file->info(), "WKT record cannot be understood");
    EXPECT_EQ(read_all(*file).dropped(), 0u);
  }
}

// PROJ would take PROJJSON, too, and follow it down until the stack ends.
TEST(LasCrs, RefusesWhatIsNoWkt) {
  std::string nested;
  for (int i = 0; i < 900; ++i)
    nested += "{\"type\":\"BoundCRS\",\"target_crs\":{},\"transformation\":{},\"source_crs\":";
  nested += "{}" + std::string(900, '}');
  for (const std::string& text :
       {nested, std::string("+proj=utm +zone=32 +type=crs"), std::string("WGS 84 / UTM zone 32N")}) {
    const TemporaryFolder folder;
    const auto file = opened(folder, with(wkt_record(text)));
    expect_warning(file->info(), "WKT record cannot be understood");
    EXPECT_EQ(file->info().crs, "");
  }
}

TEST(LasCrs, HeightsInFeetThatWereConvertedAreInMetres) {
  const std::string heights = "VERT_CS[\"h (ft)\",VERT_DATUM[\"v\",2005],UNIT[\"foot\",0.3048],AXIS[\"Up\",UP]]";
  const TemporaryFolder folder;
  const auto file = opened(folder, with(wkt_record("COMPD_CS[\"c\"," + kMetric + "," + heights + "]")));
  EXPECT_EQ(read_all(*file).x_mm[0], 10'000);
  EXPECT_EQ(read_all(*file).z_mm[0], 9144);
  EXPECT_EQ(file->info().crs.find("foot"), std::string::npos) << file->info().crs;
  EXPECT_NE(file->info().crs.find("500000"), std::string::npos) << file->info().crs;
  EXPECT_EQ(vertical_system(file->info().crs), "h");
  EXPECT_EQ(crs_units(file->info().crs).vertical_m, 1);
}

TEST(LasCrs, HeightsAreThoseOfTheKeys) {
  const TemporaryFolder folder;
  const auto heights = [&](const std::vector<std::array<std::uint16_t, 2>>& keys) {
    const auto file = opened(folder, with(geokeys(keys)));
    EXPECT_TRUE(same_horizontal_crs(file->info().crs, "EPSG:25832"));
    return vertical_system(file->info().crs);
  };
  EXPECT_EQ(heights({{1024, 1}, {3072, 25832}, {4096, 5783}}), "DHHN92 height");
  EXPECT_EQ(heights({{1024, 1}, {3072, 25832}, {4096, 5103}, {4099, 9003}}), "NAVD88 height");
  EXPECT_EQ(heights({{1024, 1}, {3072, 25832}, {4096, 6360}, {4099, 9003}}), "NAVD88 height");
  EXPECT_EQ(heights({{1024, 1}, {3072, 25832}, {4096, 1}}), "");
  EXPECT_EQ(heights({{1024, 1}, {3072, 25832}}), "");
}

// A LAS file of one point, and a box around it.
Bytes with_one_point(const Vlr& vlr, const std::array<double, 3>& scale, const std::array<std::int32_t, 3>& xyz) {
  LasSpec spec = with(vlr);
  spec.scale = scale;
  spec.xyz = {xyz};
  Bytes bytes = las_bytes(spec);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    store(&bytes[179 + 16 * axis], xyz[axis] * scale[axis]);
    store(&bytes[187 + 16 * axis], xyz[axis] * scale[axis]);
  }
  return bytes;
}

void expect_near(const PointBlock& block, std::int64_t x_mm, std::int64_t y_mm, std::int32_t z_mm) {
  ASSERT_EQ(block.size(), 1u);
  EXPECT_NEAR(static_cast<double>(block.x_mm[0]), static_cast<double>(x_mm), 1);
  EXPECT_NEAR(static_cast<double>(block.y_mm[0]), static_cast<double>(y_mm), 1);
  EXPECT_NEAR(block.z_mm[0], z_mm, 1);
}

// What the target is was asked of GDAL's gdaltransform.
TEST(LasCrs, ProjectsDegrees) {
  const std::vector<std::pair<const char*, Vlr>> cases = {
      {"WKT", wkt_record(kDegrees)},
      {"model type", geokeys({{1024, 2}, {2048, 4326}})},
      {"no model type", geokeys({{2048, 4326}})},
      {"a geographic code as projected", geokeys({{1024, 1}, {3072, 4326}})},
  };
  for (const auto& [name, vlr] : cases) {
    SCOPED_TRACE(name);
    const TemporaryFolder folder;
    const auto path =
        folder.write("a.las", with_one_point(vlr, {1e-7, 1e-7, 0.001}, {-970'000'000, 300'000'000, 5000}));
    const auto file = open_points(path);
    EXPECT_TRUE(same_horizontal_crs(file->info().crs, "EPSG:32614")) << file->info().crs;
    expect_warning(file->info(), "in degrees: projected");
    expect_near(read_all(*file), 692'915'105, 3'320'469'286, 5000);
    expect_near(read_all(*open_points(path, {.crs = "EPSG:32615", .columns = {}})), 114'051'417, 3'325'528'347, 5000);
  }
}

TEST(LasCrs, ProjectsGeocentricCoordinates) {
  const std::string wkt =
      "GEOCCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
      "UNIT[\"metre\",1],AXIS[\"Geocentric X\",OTHER],AXIS[\"Geocentric Y\",OTHER],AXIS[\"Geocentric Z\",NORTH]]";
  for (const Vlr& vlr : {wkt_record(wkt), geokeys({{1024, 3}, {2048, 4978}}), geokeys({{1024, 3}, {2048, 4326}}),
                         geokeys({{1024, 1}, {3072, 4978}})}) {
    const TemporaryFolder folder;
    const auto path =
        folder.write("a.las", with_one_point(vlr, {0.01, 0.01, 0.01}, {-70'000'000, -540'000'000, 330'000'000}));
    const auto file = open_points(path);
    EXPECT_TRUE(same_horizontal_crs(file->info().crs, "EPSG:32614")) << file->info().crs;
    EXPECT_EQ(vertical_system(file->info().crs), "ellipsoid");
    expect_warning(file->info(), "geocentric: projected");
    expect_near(read_all(*file), 653'459'194, 3'473'789'710, -5'268'401);
  }
}

// Files are about that say so.
TEST(LasCrs, IsNotBelievedWhereNothingWouldBeOnEarth) {
  for (const Vlr& vlr : {geokeys({{1024, 3}, {2048, 4326}}), wkt_record(kDegrees)}) {
    const TemporaryFolder folder;
    const auto path =
        folder.write("a.las", with_one_point(vlr, {0.001, 0.001, 0.001}, {515'396'000, 491'834'800, 2'324'000}));
    const auto file = open_points(path);
    EXPECT_EQ(file->info().crs, "");
    expect_warning(file->info(), "nowhere on Earth");
    expect_near(read_all(*file), 515'396'000, 491'834'800, 2'324'000);
  }
  const TemporaryFolder folder;
  const auto path = folder.write(
      "a.las", with_one_point(geokeys({{1024, 2}, {2048, 32767}}), {1e-7, 1e-7, 0.001}, {1'000'000, 1'000'000, 0}));
  expect_error(ErrorCode::kBadInput, path, {"in degrees", "don't name"}, [&] { open_points(path); });
}

TEST(LasCrs, MovesToAnotherSystem) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.las", with_one_point(geokeys({{1024, 1}, {3072, 25832}, {4096, 5783}}),
                                                         {0.01, 0.01, 0.01}, {70'000'000, 560'000'000, 1234}));
  const auto file = open_points(path, {.crs = "EPSG:25833", .columns = {}});
  expect_near(read_all(*file), 274'670'518, 5'601'024'569, 12'340);
  EXPECT_TRUE(same_horizontal_crs(file->info().crs, "EPSG:25833"));
  EXPECT_EQ(vertical_system(file->info().crs), "DHHN92 height");
  expect_near(read_all(*open_points(path, {.crs = "EPSG:25832", .columns = {}})), 700'000'000, 5'600'000'000, 12'340);
}

// 13 ms a time, if each asked PROJ's database again.
TEST(LasCrs, OfManyFilesIsParsedOnce) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.las", las_bytes(with(geokeys({{1024, 1}, {3072, 25833}}))));
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 4000; ++i) EXPECT_EQ(open_points(path)->info().crs, "EPSG:25833");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST(LasCrs, KeepsACodeThatNobodyKnows) {
  const TemporaryFolder folder;
  const auto file = opened(folder, with(geokeys({{1024, 1}, {3072, 65000}})));
  EXPECT_EQ(file->info().crs, "EPSG:65000");
  expect_warning(file->info(), "not in the PROJ database");
}

TEST(LasCrs, ToleratesAGeokeyDirectoryThatIsCut) {
  const TemporaryFolder folder;
  Vlr vlr = geokeys({{1024, 1}, {3072, 25832}});
  store(&vlr.content[6], std::uint16_t{0xFFFF});
  vlr.content.resize(vlr.content.size() - 3);
  EXPECT_EQ(opened(folder, with(vlr))->info().crs, "");
}

}  // namespace
}  // namespace btms::test
