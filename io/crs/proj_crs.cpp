#include "io/crs/proj_crs.h"

#include <proj_experimental.h>

#include <string_view>

namespace btms {
namespace {

// "EPSG:25832", "ESRI:102032", "EPSG:25832+5783", "urn:ogc:def:crs:EPSG::25832".
bool is_code(const std::string& crs) {
  constexpr std::string_view kKnown = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_:+,.-";
  return crs.size() < 64 && crs.find(':') != crs.npos && crs.front() != '+' &&
         crs.find_first_not_of(kKnown) == crs.npos;
}

}  // namespace

// Not everything proj_create() takes: among that are the names of files to read, and PROJJSON, whose nesting it follows
// down the stack.
ProjObject parse_crs(PJ_CONTEXT* context, const std::string& crs) {
  ProjObject object(is_code(crs) ? proj_create(context, crs.c_str())
                                 : proj_create_from_wkt(context, crs.c_str(), nullptr, nullptr, nullptr));
  if (!object || !proj_is_crs(object.get())) return nullptr;
  if (proj_get_type(object.get()) == PJ_TYPE_BOUND_CRS) object.reset(proj_get_source_crs(context, object.get()));
  return object;
}

ProjObject crs_part(PJ_CONTEXT* context, const PJ* crs, int index) {
  if (proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS) return ProjObject(proj_crs_get_sub_crs(context, crs, index));
  return index == 0 ? ProjObject(proj_clone(context, crs)) : nullptr;
}

ProjObject plane_part(PJ_CONTEXT* context, const PJ* crs) {
  ProjObject horizontal = crs_part(context, crs, 0);
  if (!horizontal || proj_get_type(horizontal.get()) == PJ_TYPE_GEOCENTRIC_CRS) return nullptr;
  const ProjObject system(proj_crs_get_coordinate_system(context, horizontal.get()));
  if (system && proj_cs_get_axis_count(context, system.get()) == 3)
    horizontal.reset(proj_crs_demote_to_2D(context, nullptr, horizontal.get()));
  return horizontal;
}

}  // namespace btms
