#include "io/points/las_crs.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "io/crs/crs_units.h"
#include "io/points/little_endian.h"

namespace btms {
namespace {

constexpr std::uint16_t kWktRecord = 2112, kGeoKeyRecord = 34735;

// GeoTIFF keys and values (OGC 19-008r4).
enum GeoKey : std::uint16_t {
  kModelType = 1024,
  kGeographic = 2048,
  kProjected = 3072,
  kLinearUnit = 3076,
  kVertical = 4096,
  kVerticalUnit = 4099
};
constexpr std::uint16_t kModelGeographic = 2, kModelGeocentric = 3, kUserDefined = 32767;

const LasRecord* find(const LasHeader& header, std::uint16_t id) {
  for (const LasRecord& record : header.records)
    if (record.user == "LASF_Projection" && record.id == id && record.bytes != 0) return &record;
  return nullptr;
}

std::vector<std::uint8_t> content(const InputFile& file, const LasRecord& record) {
  // An extended record may claim the whole file; no coordinate system is that long.
  constexpr std::uint64_t kLongest = 1 << 16;
  std::vector<std::uint8_t> bytes(std::min(record.bytes, kLongest));
  file.open().read(record.offset, bytes);
  return bytes;
}

std::string read_wkt(const InputFile& file, const LasHeader& header) {
  const LasRecord* record = find(header, kWktRecord);
  if (record == nullptr) return {};
  const std::vector<std::uint8_t> bytes = content(file, *record);
  return {bytes.begin(), std::find(bytes.begin(), bytes.end(), 0)};
}

// Keys whose value stands in the directory itself; the others (citations, parameters) say nothing we use.
std::map<std::uint16_t, std::uint16_t> read_geokeys(const InputFile& file, const LasHeader& header) {
  std::map<std::uint16_t, std::uint16_t> keys;
  const LasRecord* record = find(header, kGeoKeyRecord);
  if (record == nullptr) return keys;
  const std::vector<std::uint8_t> bytes = content(file, *record);
  for (std::size_t at = 8; at + 8 <= bytes.size(); at += 8)  // the first four words are version and count
    if (load<std::uint16_t>(&bytes[at + 2]) == 0)
      keys.emplace(load<std::uint16_t>(&bytes[at]), load<std::uint16_t>(&bytes[at + 6]));
  return keys;
}

// Metres per unit for the code in `key`, or 0 when there is none we know.
double linear_unit(const std::map<std::uint16_t, std::uint16_t>& keys, std::uint16_t key, LasCrs& crs) {
  const auto it = keys.find(key);
  if (it == keys.end() || it->second == 0 || it->second == kUserDefined) return 0;
  switch (it->second) {
    case 9001:
      return 1;
    case 9002:
      return 0.3048;
    case 9003:
      return 1200.0 / 3937.0;
    default:
      crs.warnings.push_back("linear unit " + std::to_string(it->second) + " is not known here: ignored");
      return 0;
  }
}

std::string epsg(const std::map<std::uint16_t, std::uint16_t>& keys, std::uint16_t key) {
  const auto it = keys.find(key);
  if (it == keys.end() || it->second == 0 || it->second == kUserDefined) return {};
  return "EPSG:" + std::to_string(it->second);
}

[[noreturn]] void refuse_unnamed(const InputFile& file, const char* kind) {
  file.refuse(std::string("coordinates are ") + kind +
              " by its GeoTIFF keys, which don't name their system; reproject the file to one in metres first");
}

std::string factor(double metres) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, metres, std::chars_format::general, 10).ptr};
}

void convert(double horizontal_m, double vertical_m, LasCrs& crs) {
  crs.horizontal_m = horizontal_m;
  crs.vertical_m = vertical_m;
  if (horizontal_m != 1) {
    crs.warnings.push_back("horizontal coordinates are in units of " + factor(horizontal_m) +
                           " m (feet): converted to metres");
  }
  if (vertical_m != 1)
    crs.warnings.push_back("heights are in units of " + factor(vertical_m) + " m (feet): converted to metres");
}

// A system whose own unit is not the metre no longer describes the converted coordinates.
void set_text(const std::string& text, const CrsUnits& units, LasCrs& crs) {
  const bool heights_in_metres = units.vertical_m == 0 || units.vertical_m == 1;
  crs.text = units.horizontal_m == 1 && heights_in_metres ? text : crs_in_metres(text);
  if (crs.text.empty()) crs.warnings.emplace_back("the coordinate system has no equal in metres: treated as unknown");
}

bool is_plane(const CrsUnits& units) { return !units.in_degrees && !units.geocentric; }

// Degrees, or metres from the centre of the Earth: for who projects them.
void use_as_it_is(const std::string& text, const CrsUnits& units, LasCrs& crs) {
  crs.kind = units.geocentric ? LasCrs::Kind::kGeocentric : LasCrs::Kind::kDegrees;
  crs.text = text;
  if (units.in_degrees && units.vertical_m != 0) crs.vertical_m = units.vertical_m;
}

// The system of heights that the keys name: "EPSG:5703", or empty.
std::string vertical_code(const std::map<std::uint16_t, std::uint16_t>& keys) {
  constexpr const char* kOldNavd88 = "EPSG:5103";  // of GeoTIFF 1.0; now the code of its datum
  const std::string code = epsg(keys, kVertical);
  return code == kOldNavd88 ? "EPSG:5703" : code;
}

bool use_wkt(const InputFile& file, const LasHeader& header, LasCrs& crs) {
  const std::string wkt = read_wkt(file, header);
  if (wkt.empty()) return false;
  const CrsUnits units = crs_units(wkt);
  if (!units.understood) {
    crs.warnings.emplace_back("the WKT record cannot be understood: ignored");
    return false;
  }
  if (!is_plane(units)) {
    use_as_it_is(wkt, units, crs);
    return true;
  }
  convert(units.horizontal_m, units.vertical_m != 0 ? units.vertical_m : units.horizontal_m, crs);
  set_text(wkt, units, crs);
  return true;
}

void use_geokeys(const InputFile& file, const LasHeader& header, LasCrs& crs) {
  const auto keys = read_geokeys(file, header);
  const std::string projected = epsg(keys, kProjected), geographic = epsg(keys, kGeographic);
  const auto model = keys.find(kModelType);
  const bool in_degrees = model != keys.end() ? model->second == kModelGeographic
                                              : keys.find(kProjected) == keys.end() && !geographic.empty();
  // A geocentric code (EPSG:4978) stands under the geographic key, or even under the projected one.
  const bool geocentric = model != keys.end() && model->second == kModelGeocentric;
  const std::string& named = in_degrees || geocentric ? geographic : projected;
  const CrsUnits units = named.empty() ? CrsUnits{} : crs_units(named);
  if (in_degrees || geocentric || !is_plane(units)) {
    // Some write the geographic code of the datum.
    CrsUnits as = units;
    as.geocentric = geocentric || units.geocentric;
    as.in_degrees = !as.geocentric;
    const bool fits = units.understood && units.geocentric == as.geocentric;
    const bool is_wgs84 = named.empty() || named == "EPSG:4326" || named == "EPSG:4979";
    if (!fits && !(as.geocentric && is_wgs84)) refuse_unnamed(file, as.geocentric ? "geocentric" : "in degrees");
    return use_as_it_is(fits ? named : "EPSG:4978", as, crs);
  }

  const double stated = linear_unit(keys, kLinearUnit, crs), stated_vertical = linear_unit(keys, kVerticalUnit, crs);
  // A stated unit wins over that of the EPSG code: the keys describe these coordinates, the code a system.
  const double horizontal = stated != 0 ? stated : units.horizontal_m;
  const std::string heights = vertical_code(keys);
  const CrsUnits both =
      projected.empty() || heights.empty() ? CrsUnits{} : crs_units(projected + "+" + heights.substr(5));
  // A code of heights in feet means feet; that of metres stands in many a file of feet without a stated unit.
  const double coded = both.vertical_m == 1 ? 0 : both.vertical_m;
  convert(horizontal, stated_vertical != 0 ? stated_vertical : coded != 0 ? coded : horizontal, crs);
  if (projected.empty()) return;
  if (!units.understood) {
    crs.text = projected;
    crs.warnings.push_back(projected + " is not in the PROJ database: its unit is " +
                           (stated != 0 ? "taken from the keys" : "taken to be the metre"));
    return;
  }
  set_text(projected, units, crs);
  if (!heights.empty()) {
    // Named, or of no use: the unit was settled above.
    if (vertical_system(projected + "+" + heights.substr(5)).empty())
      crs.warnings.push_back(heights + " is no vertical system that PROJ knows: left out");
    else
      crs.text = crs_in_metres(with_heights_of(crs.text, projected + "+" + heights.substr(5)));
  }
}

}  // namespace

LasCrs read_las_crs(const InputFile& file, const LasHeader& header) {
  LasCrs crs;
  if (!use_wkt(file, header, crs)) use_geokeys(file, header, crs);
  return crs;
}

}  // namespace btms
