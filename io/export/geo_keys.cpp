#include "io/export/geo_keys.h"

#include "io/crs/crs.h"

namespace btms {
namespace {

enum Key : std::uint16_t {
  kModelType = 1024,
  kRasterType = 1025,
  kGeographicCrs = 2048,
  kProjectedCrs = 3072,
  kProjectedCitation = 3073,
  kVerticalCrs = 4096,
  kVerticalUnits = 4099,
};
constexpr std::uint16_t kProjected = 1, kGeographic = 2, kPixelIsArea = 1, kUserDefined = 32767, kMetre = 9001,
                        kTextTag = 34737;
bool is_code(int epsg) { return epsg > 0 && epsg < kUserDefined; }

}  // namespace

GeoKeys geo_keys(const std::string& crs_wkt) {
  GeoKeys out;
  if (crs_wkt.empty()) return out;  // pixels are areas where nothing else is said
  const Crs crs = describe_crs(crs_wkt);
  out.unit_m = crs.linear_unit_m;
  std::uint16_t count = 0;
  out.directory = {1, 1, 1, 0};  // GeoTIFF 1.1; the number of keys follows
  const auto add = [&](Key key, std::uint16_t tag, std::uint16_t n, std::uint16_t value) {  // keys ascend
    out.directory.insert(out.directory.end(), {key, tag, n, value});
    ++count;
  };
  if (is_code(crs.horizontal_epsg)) {
    const auto code = static_cast<std::uint16_t>(crs.horizontal_epsg);
    add(kModelType, 0, 1, crs.is_geographic ? kGeographic : kProjected);
    add(kRasterType, 0, 1, kPixelIsArea);
    add(crs.is_geographic ? kGeographicCrs : kProjectedCrs, 0, 1, code);
  } else {
    // A model of its own, whose citation is the text: how GDAL and Esri's programs pass on what has no code.
    out.text = "ESRI PE String = " + crs.esri_wkt + "|";
    add(kModelType, 0, 1, kUserDefined);
    add(kRasterType, 0, 1, kPixelIsArea);
    add(kProjectedCitation, kTextTag, static_cast<std::uint16_t>(out.text.size()), 0);
  }
  if (is_code(crs.vertical_epsg) && crs.vertical_unit_m == 1) {  // our heights are metres
    add(kVerticalCrs, 0, 1, static_cast<std::uint16_t>(crs.vertical_epsg));
    add(kVerticalUnits, 0, 1, kMetre);
  }
  out.directory[3] = count;
  return out;
}

}  // namespace btms
