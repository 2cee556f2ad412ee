#include "io/crs/crs.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <string_view>

#include "engine/error.h"
#include "io/crs/proj_objects.h"

namespace btms {
namespace {

using Object = ProjObject;

// EPSG method -> CF grid mapping; EPSG parameter -> CF attribute within it.
struct Method {
  int epsg;
  const char* cf_name;
};
constexpr Method kMethods[] = {
    {9807, "transverse_mercator"},
    {9801, "lambert_conformal_conic"},
    {9802, "lambert_conformal_conic"},
    {9804, "mercator"},
    {9805, "mercator"},
    {9810, "polar_stereographic"},
    {9829, "polar_stereographic"},
    {9820, "lambert_azimuthal_equal_area"},
    {9822, "albers_conical_equal_area"},
};

// One parameter may become different attributes in different mappings; CF has no others than these.
const char* cf_parameter(int parameter_epsg, std::string_view mapping) {
  const bool tm = mapping == "transverse_mercator", polar = mapping == "polar_stereographic";
  const bool merc = mapping == "mercator";
  switch (parameter_epsg) {
    case 8801:
    case 8821:
      return merc ? nullptr : "latitude_of_projection_origin";
    case 8802:
    case 8822:
    case 8833:
      return polar                                               ? "straight_vertical_longitude_from_pole"
             : merc || mapping == "lambert_azimuthal_equal_area" ? "longitude_of_projection_origin"
                                                                 : "longitude_of_central_meridian";
    case 8805:
      return tm ? "scale_factor_at_central_meridian" : "scale_factor_at_projection_origin";
    case 8806:
    case 8826:
      return "false_easting";
    case 8807:
    case 8827:
      return "false_northing";
    case 8823:
    case 8832:
      return "standard_parallel";
    default:
      return nullptr;
  }
}

void add_conversion(PJ_CONTEXT* context, const PJ* projected, double unit_m, Crs& crs) {
  const Object conversion(proj_crs_get_coordoperation(context, projected));
  const char* code = nullptr;
  if (!conversion || !proj_coordoperation_get_method_info(context, conversion.get(), nullptr, nullptr, &code) || !code)
    return;
  for (const Method& m : kMethods)
    if (std::to_string(m.epsg) == code) crs.grid_mapping_name = m.cf_name;
  if (crs.grid_mapping_name.empty()) return;
  const int n = proj_coordoperation_get_param_count(context, conversion.get());
  for (int i = 0; i < n; ++i) {
    const char *parameter = nullptr, *category = nullptr;
    double value = 0, to_si = 1;
    if (!proj_coordoperation_get_param(context, conversion.get(), i, nullptr, nullptr, &parameter, &value, nullptr,
                                       &to_si, nullptr, nullptr, nullptr, &category) ||
        !parameter)
      continue;
    const int epsg = std::atoi(parameter);
    const char* name = cf_parameter(epsg, crs.grid_mapping_name);
    if (!name) continue;
    const std::string_view kind = category ? category : "";
    const double degree = std::numbers::pi / 180;
    if (kind == "angular" && std::abs(to_si - degree) > 1e-15) value *= to_si / degree;
    if (kind == "linear") value *= to_si / unit_m;  // CF wants the unit of x and y
    crs.parameters.emplace_back(name, value);
  }
  // A second parallel extends the attribute to two values in CF; crs_wkt carries it, so the mapping is left unnamed.
  for (int i = 0; i < n; ++i) {
    const char* parameter = nullptr;
    proj_coordoperation_get_param(context, conversion.get(), i, nullptr, nullptr, &parameter, nullptr, nullptr, nullptr,
                                  nullptr, nullptr, nullptr, nullptr);
    if (parameter && std::string_view(parameter) == "8824") {
      crs.grid_mapping_name.clear();
      crs.parameters.clear();
      return;
    }
  }
}

void add_ellipsoid(PJ_CONTEXT* context, const PJ* horizontal, Crs& crs) {
  const Object ellipsoid(proj_get_ellipsoid(context, horizontal));
  double major_m = 0, inverse_flattening = 0;
  if (ellipsoid &&
      proj_ellipsoid_get_parameters(context, ellipsoid.get(), &major_m, nullptr, nullptr, &inverse_flattening)) {
    crs.parameters.emplace_back("semi_major_axis", major_m);
    crs.parameters.emplace_back("inverse_flattening", inverse_flattening);
  }
}

int epsg_of(const PJ* object) {
  const char *authority = proj_get_id_auth_name(object, 0), *code = proj_get_id_code(object, 0);
  return authority && code && std::string_view(authority) == "EPSG" ? std::atoi(code) : 0;
}

// Metres per unit of the heights of a compound or three-dimensional system; 0 when it has none.
double vertical_unit(PJ_CONTEXT* context, const PJ* whole, const PJ* horizontal_system) {
  double unit_m = 0;
  const auto read_axis = [&](const PJ* system, int axis) {
    proj_cs_get_axis_info(context, system, axis, nullptr, nullptr, nullptr, &unit_m, nullptr, nullptr, nullptr);
  };
  if (proj_get_type(whole) == PJ_TYPE_COMPOUND_CRS) {
    const Object part(proj_crs_get_sub_crs(context, whole, 1));
    const Object system(part ? proj_crs_get_coordinate_system(context, part.get()) : nullptr);
    if (system) read_axis(system.get(), 0);
  } else if (horizontal_system && proj_cs_get_axis_count(context, horizontal_system) == 3) {
    read_axis(horizontal_system, 2);
  }
  return unit_m;
}

}  // namespace

Crs describe_crs(const std::string& text) {
  const bool is_wkt = text.find('[') != std::string::npos;
  const auto fail = [&](const std::string& why) -> Error {
    const std::string shown = text.size() > 60 ? text.substr(0, 60) + "..." : text;
    return Error(is_wkt ? ErrorCode::kBadInput : ErrorCode::kUsage,
                 "coordinate reference system '" + shown + "' " + why + "; expected \"EPSG:n\" or WKT");
  };
  const ProjContext context = quiet_proj_context();
  if (!context) throw Error(ErrorCode::kFailed, "PROJ could not start");

  Object object(proj_create(context.get(), text.c_str()));
  if (!object || !proj_is_crs(object.get())) throw fail("is not known to PROJ");
  if (proj_get_type(object.get()) == PJ_TYPE_BOUND_CRS)  // a datum shift that WKT 1 carries along
    object.reset(proj_get_source_crs(context.get(), object.get()));

  Crs crs;
  constexpr const char* kOptions[] = {"MULTILINE=NO", nullptr};
  const char* wkt = object ? proj_as_wkt(context.get(), object.get(), PJ_WKT2_2019, kOptions) : nullptr;
  if (!wkt) throw fail("has no form in WKT2");
  crs.wkt = wkt;

  Object part;
  const PJ* horizontal = object.get();
  if (proj_get_type(horizontal) == PJ_TYPE_COMPOUND_CRS) {
    part.reset(proj_crs_get_sub_crs(context.get(), horizontal, 0));
    horizontal = part.get();
    crs.height_standard_name = "surface_altitude";  // the second part is a vertical system over a geoid
  }
  if (!horizontal) throw fail("has no horizontal part");
  const PJ_TYPE type = proj_get_type(horizontal);
  crs.is_geographic = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  if (type == PJ_TYPE_VERTICAL_CRS || type == PJ_TYPE_GEOCENTRIC_CRS || type == PJ_TYPE_TEMPORAL_CRS)
    throw fail("has no plane coordinates");

  crs.horizontal_epsg = epsg_of(horizontal);
  crs.epsg = crs.horizontal_epsg > 0 ? crs.horizontal_epsg : epsg_of(object.get());
  if (horizontal != object.get())
    if (const Object vertical(proj_crs_get_sub_crs(context.get(), object.get(), 1)); vertical) {
      crs.vertical_name = proj_get_name(vertical.get());
      crs.vertical_epsg = epsg_of(vertical.get());
    }
  if (const char* esri = proj_as_wkt(context.get(), horizontal, PJ_WKT1_ESRI, kOptions)) crs.esri_wkt = esri;

  const Object system(proj_crs_get_coordinate_system(context.get(), horizontal));
  double unit = 1;
  crs.vertical_unit_m = vertical_unit(context.get(), object.get(), system.get());
  if (system && proj_cs_get_axis_count(context.get(), system.get()) == 3)
    crs.height_standard_name = "height_above_reference_ellipsoid";
  if (system &&
      proj_cs_get_axis_info(context.get(), system.get(), 0, nullptr, nullptr, nullptr, &unit, nullptr, nullptr,
                            nullptr) &&
      !crs.is_geographic && unit > 0)
    crs.linear_unit_m = unit;

  if (crs.is_geographic) crs.grid_mapping_name = "latitude_longitude";
  if (type == PJ_TYPE_PROJECTED_CRS) add_conversion(context.get(), horizontal, crs.linear_unit_m, crs);
  add_ellipsoid(context.get(), horizontal, crs);
  return crs;
}

std::string normalise_crs(const std::string& wkt_or_epsg) {
  return wkt_or_epsg.empty() ? std::string() : describe_crs(wkt_or_epsg).wkt;
}

}  // namespace btms
