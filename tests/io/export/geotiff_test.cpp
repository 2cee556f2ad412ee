// GeoTIFFs as GDAL reads them. Without python3-gdal only what libtiff reads is compared.
#include "io/export/geotiff.h"

#include <gtest/gtest.h>
#include <tiffio.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/export/occupancy.h"
#include "io/crs/crs.h"
#include "tests/engine/query/query_map.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

// Oblique Mercator of nobody: no register has a code for it.
const std::string kOwnCrs =
    "PROJCRS[\"works\",BASEGEOGCRS[\"WGS 84\",DATUM[\"World Geodetic System 1984\",ELLIPSOID[\"WGS "
    "84\",6378137,298.257223563]],ID[\"EPSG\",4326]],CONVERSION[\"grid\",METHOD[\"Transverse "
    "Mercator\",ID[\"EPSG\",9807]],PARAMETER[\"Latitude of natural "
    "origin\",51,ANGLEUNIT[\"degree\",0.0174532925199433]],"
    "PARAMETER[\"Longitude of natural origin\",7.25,ANGLEUNIT[\"degree\",0.0174532925199433]],PARAMETER[\"Scale factor "
    "at natural origin\",1,SCALEUNIT[\"unity\",1]],PARAMETER[\"False easting\",1000,LENGTHUNIT[\"metre\",1]],"
    "PARAMETER[\"False "
    "northing\",2000,LENGTHUNIT[\"metre\",1]]],CS[Cartesian,2],AXIS[\"(E)\",east],AXIS[\"(N)\",north],"
    "LENGTHUNIT[\"metre\",1]]";

Window window_of(std::size_t layers, const CellBox& box = {-3, -2, 45, 31}) {
  std::vector<const RasterLayer*> wanted;
  for (std::size_t l = 0; l < layers; ++l) wanted.push_back(&raster_layers()[l]);
  return cut_window(test::rolling_map(3), 0, box, wanted);
}

bool has_gdal() {
  static const bool found = std::system("/usr/bin/python3 -c 'import osgeo' 2>/dev/null") == 0;
  return found;
}

// What GDAL says of files; tests that ask it are skipped without.
std::vector<Json> gdal(const std::string& files) {
  const std::string script = std::string(BTMS_SOURCE_DIR) + "/tests/io/export/read_geotiff.py";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(("/usr/bin/python3 " + script + " " + files).c_str(), "r"),
                                                   pclose);
  std::vector<Json> found;
  std::array<char, 65536> line{};
  while (std::fgets(line.data(), line.size(), pipe.get())) found.push_back(Json::parse(line.data()));
  return found;
}

Bytes bytes_of(const Window& window) {
  Bytes bytes;
  for (const std::vector<float>& layer : window.values) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(layer.data());
    bytes.insert(bytes.end(), from, from + layer.size() * sizeof(float));
  }
  return bytes;
}

Bytes file_bytes(const fs::path& path) {
  const std::string text = file_text(path);
  return {text.begin(), text.end()};
}

void write_bytes(const fs::path& path, const Bytes& bytes) { write_text(path, {bytes.begin(), bytes.end()}); }

Bytes libtiff_reads(const fs::path& path) {
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(TIFFOpen(path.c_str(), "r"), TIFFClose);
  std::uint32_t cols = 0, rows = 0, edge = 0;
  std::uint16_t layers = 0;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &cols);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &rows);
  TIFFGetField(tiff.get(), TIFFTAG_TILEWIDTH, &edge);
  TIFFGetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &layers);
  std::vector<float> tile(static_cast<std::size_t>(edge) * edge),
      values(static_cast<std::size_t>(rows) * cols * layers);
  for (std::uint16_t layer = 0; layer < layers; ++layer)
    for (std::uint32_t row0 = 0; row0 < rows; row0 += edge)
      for (std::uint32_t col0 = 0; col0 < cols; col0 += edge) {
        EXPECT_GT(TIFFReadTile(tiff.get(), tile.data(), col0, row0, 0, layer), 0);
        for (std::uint32_t row = row0; row < std::min(rows, row0 + edge); ++row)
          for (std::uint32_t col = col0; col < std::min(cols, col0 + edge); ++col)
            values[(static_cast<std::size_t>(layer) * rows + row) * cols + col] =
                tile[static_cast<std::size_t>(row - row0) * edge + (col - col0)];
      }
  const auto* from = reinterpret_cast<const std::uint8_t*>(values.data());
  return {from, from + values.size() * sizeof(float)};
}

TEST(GeoTiff, KeepsEveryBit) {
  const TemporaryFolder folder;
  for (const std::size_t layers : {1, 2, 9}) {
    const Window window = window_of(layers);
    write_bytes(folder / "w.tif", geotiff(window, ""));
    EXPECT_EQ(libtiff_reads(folder / "w.tif"), bytes_of(window));
  }
  EXPECT_EQ(geotiff(window_of(3), "EPSG:25832"), geotiff(window_of(3), "EPSG:25832"));
}

// The same in parts, to disk.
TEST(GeoTiff, OfPartsIsThatOfTheWhole) {
  const TemporaryFolder folder;
  const RasterLayer* layers[] = {&raster_layers()[0], &raster_layers()[3]};
  const MemoryMap map = test::rolling_map(3);
  constexpr std::int32_t kEdge = GeoTiffFile::kTileEdge;
  const CellBox box{-10, -2 * kEdge - 5, 300, 48};
  const Window whole = cut_window(map, 0, box, layers);
  GeoTiffFile file(folder / "s.tif", whole, "EPSG:25832");
  for (std::int32_t col0 = box.col0; col0 < box.col1; col0 += kEdge)
    for (std::int32_t row1 = box.row1; row1 > box.row0; row1 -= kEdge) {
      const CellBox part{col0, std::max(box.row0, row1 - kEdge), std::min(box.col1, col0 + kEdge), row1};
      file.put(static_cast<std::size_t>(box.row1 - row1), static_cast<std::size_t>(col0 - box.col0),
               cut_window(map, 0, part, layers));
    }
  EXPECT_FALSE(fs::exists(folder / "s.tif"));
  file.commit();
  EXPECT_EQ(libtiff_reads(folder / "s.tif"), bytes_of(whole));
}

TEST(GeoTiff, GdalFindsPlaceValuesAndReferenceSystem) {
  if (!has_gdal()) GTEST_SKIP() << "python3-gdal is not installed";
  const TemporaryFolder folder;
  const Window window = window_of(4);
  std::string files;
  const std::pair<const char*, std::string> kSystems[] = {{"none.tif", ""},
                                                          {"utm.tif", "EPSG:25832"},
                                                          {"own.tif", describe_crs(kOwnCrs).wkt},
                                                          {"compound.tif", "EPSG:5555"},
                                                          {"feet.tif", "EPSG:2263"}};
  for (const auto& [name, crs] : kSystems) {
    write_bytes(folder / name, geotiff(window, crs));
    files += (folder / name).string() + " ";
  }
  const std::vector<Json> found = gdal(files);
  ASSERT_EQ(found.size(), 5u);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Json& f = found[i];
    SCOPED_TRACE(f.dump());
    EXPECT_EQ(f["driver"], "GTiff");
    EXPECT_EQ(f["size"], Json({window.cols, window.rows}));
    EXPECT_EQ(f["area"], "Area");
    EXPECT_EQ(f["structure"]["COMPRESSION"], "DEFLATE");
    EXPECT_EQ(f["nodata"], Json({"nan", "nan", "nan", "nan"}));
    EXPECT_EQ(f["names"], Json({"elevation", "elevation_sd", "slope", "class"}));
    EXPECT_EQ(f["units"][0], "m");
    EXPECT_EQ(f["units"][2], "degree");
    EXPECT_EQ(f["types"][0], "Float32");
    EXPECT_EQ(file_bytes(folder / (std::string(kSystems[i].first) + ".f32").c_str()), bytes_of(window));
    if (i < 4) {
      EXPECT_EQ(f["frame"], Json({-6.0, 2.0, 0.0, 62.0, 0.0, -2.0}));
    }
  }
  EXPECT_EQ(found[0]["crs"], Json());
  EXPECT_EQ(found[1]["epsg"], "25832");
  EXPECT_EQ(found[1]["is_utm32"], true);
  const std::string own = found[2]["proj4"].is_string() ? found[2]["proj4"] : Json("");
  for (const char* part : {"+proj=tmerc", "+lat_0=51", "+lon_0=7.25", "+x_0=1000", "+y_0=2000"})
    EXPECT_NE(own.find(part), own.npos) << own;
  EXPECT_EQ(found[3]["parts"], Json({"25832", "5783"})) << found[3];
  EXPECT_EQ(found[4]["epsg"], "2263");
  EXPECT_NEAR(found[4]["frame"][1].get<double>(), 2.0 * 3937 / 1200, 1e-9);
  EXPECT_NEAR(found[4]["frame"][3].get<double>(), 62.0 * 3937 / 1200, 1e-9);
}

TEST(Costmap, GdalReadsBothForms) {
  if (!has_gdal()) GTEST_SKIP() << "python3-gdal is not installed";
  const TemporaryFolder folder;
  const RasterLayer* layers[] = {find_raster_layer("cost"), find_raster_layer("class")};
  const Occupancy map =
      occupancy_of(cut_window(test::rolling_map(3), 0, {-3, -2, 45, 31}, layers), OccupancyMode::kTrinary, 1.5);
  write_bytes(folder / "c.pgm", map.pgm());
  write_bytes(folder / "c.png", map.png());
  const auto found = gdal((folder / "c.pgm").string() + " " + (folder / "c.png").string());
  ASSERT_EQ(found.size(), 2u);
  for (const Json& f : found) {
    EXPECT_EQ(f["size"], Json({48, 33}));
    EXPECT_EQ(f["types"], Json({"Byte"}));
  }
  const Bytes pgm = file_bytes(folder / "c.pgm.f32");
  EXPECT_EQ(pgm, file_bytes(folder / "c.png.f32"));
  ASSERT_EQ(pgm.size(), map.pixels.size() * sizeof(float));
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    float value;
    std::memcpy(&value, pgm.data() + i * sizeof value, sizeof value);
    ASSERT_EQ(value, map.pixels[i]);
  }
}

}  // namespace
}  // namespace btms
