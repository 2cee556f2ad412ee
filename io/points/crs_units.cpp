#include "io/points/crs_units.h"

#include <proj.h>
#include <proj_experimental.h>  // proj_crs_alter_*: "experimental" since PROJ 5, unchanged up to 9

#include <map>
#include <memory>
#include <mutex>
#include <string_view>

namespace btms {
namespace {

struct Free {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
  void operator()(PJ* object) const { proj_destroy(object); }
};
using Context = std::unique_ptr<PJ_CONTEXT, Free>;
using Object = std::unique_ptr<PJ, Free>;

// One context a call: PROJ's contexts are not thread-safe.
Context quiet_context() {
  Context context(proj_context_create());
  proj_log_level(context.get(), PJ_LOG_NONE);  // stderr belongs to the program
  proj_context_set_enable_network(context.get(), 0);
  return context;
}

// "EPSG:25832", "ESRI:102032", "EPSG:25832+5783", "urn:ogc:def:crs:EPSG::25832".
bool is_code(const std::string& crs) {
  constexpr std::string_view kKnown = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_:+,.-";
  return crs.size() < 64 && crs.find(':') != crs.npos && crs.front() != '+' &&
         crs.find_first_not_of(kKnown) == crs.npos;
}

// Not everything proj_create() takes: among that are the names of files to read, and PROJJSON, whose nesting it follows
// down the stack.
Object parse(PJ_CONTEXT* context, const std::string& crs) {
  Object object(is_code(crs) ? proj_create(context, crs.c_str())
                             : proj_create_from_wkt(context, crs.c_str(), nullptr, nullptr, nullptr));
  if (!object || !proj_is_crs(object.get())) return nullptr;
  if (proj_get_type(object.get()) == PJ_TYPE_BOUND_CRS) object.reset(proj_get_source_crs(context, object.get()));
  return object;
}

// Part 0 (horizontal) or 1 (vertical) of a compound system; a plain one is its own part 0.
Object part(PJ_CONTEXT* context, const PJ* crs, int index) {
  if (proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS) return Object(proj_crs_get_sub_crs(context, crs, index));
  return index == 0 ? Object(proj_clone(context, crs)) : nullptr;
}

// Metres (or radians) per unit of the first axis, 0 when unknown.
double unit(PJ_CONTEXT* context, const PJ* crs) {
  const Object system(proj_crs_get_coordinate_system(context, crs));
  double factor = 0;
  if (!system ||
      !proj_cs_get_axis_info(context, system.get(), 0, nullptr, nullptr, nullptr, &factor, nullptr, nullptr, nullptr)) {
    return 0;
  }
  return factor;
}

// The same for the third axis of a system that has one; 0 for plane systems.
double third_unit(PJ_CONTEXT* context, const PJ* crs) {
  const Object system(proj_crs_get_coordinate_system(context, crs));
  double factor = 0;
  if (!system || proj_cs_get_axis_count(context, system.get()) != 3 ||
      !proj_cs_get_axis_info(context, system.get(), 2, nullptr, nullptr, nullptr, &factor, nullptr, nullptr, nullptr)) {
    return 0;
  }
  return factor;
}

// Results by text. A handful of systems is all a program meets; the limit is against files made to fill the memory.
template <typename Value>
class Cache {
 public:
  template <typename Compute>
  Value get(const std::string& text, Compute compute) {
    const std::lock_guard lock(mutex_);
    const auto it = values_.find(text);
    if (it != values_.end()) return it->second;
    if (values_.size() == kMost) values_.clear();
    return values_.emplace(text, compute()).first->second;
  }

 private:
  static constexpr std::size_t kMost = 16;
  std::mutex mutex_;  // held while computing, so that each text is parsed once
  std::map<std::string, Value> values_;
};

// From a micrometre to a thousand kilometres: what is beyond is damage, and would take coordinates out of all numbers.
bool is_sane_unit(double metres) { return metres >= 1e-6 && metres <= 1e6; }

bool is_geographic(PJ_TYPE type) {
  return type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS || type == PJ_TYPE_GEOGRAPHIC_CRS;
}

CrsUnits parse_units(const std::string& crs) {
  const Context context = quiet_context();
  const Object whole = parse(context.get(), crs);
  const Object horizontal = whole ? part(context.get(), whole.get(), 0) : nullptr;
  if (!horizontal) return {};
  const Object vertical = part(context.get(), whole.get(), 1);
  CrsUnits units;
  units.in_degrees = is_geographic(proj_get_type(horizontal.get()));
  units.geocentric = proj_get_type(horizontal.get()) == PJ_TYPE_GEOCENTRIC_CRS;
  units.horizontal_m = unit(context.get(), horizontal.get());
  units.vertical_m = vertical ? unit(context.get(), vertical.get()) : third_unit(context.get(), horizontal.get());
  units.understood = is_sane_unit(units.horizontal_m) && (units.vertical_m == 0 || is_sane_unit(units.vertical_m));
  return units;
}

std::string convert_to_metres(const std::string& crs) {
  const Context context = quiet_context();
  PJ_CONTEXT* c = context.get();
  const Object whole = parse(c, crs);
  Object horizontal = whole ? part(c, whole.get(), 0) : nullptr;
  if (horizontal && third_unit(c, horizontal.get()) != 0)
    horizontal.reset(proj_crs_demote_to_2D(c, nullptr, horizontal.get()));
  if (horizontal && unit(c, horizontal.get()) == 1) {  // as it stands, with its EPSG code
    const char* text = proj_as_wkt(c, horizontal.get(), PJ_WKT2_2019, nullptr);
    return text == nullptr ? std::string() : text;
  }
  if (!horizontal || proj_get_type(horizontal.get()) != PJ_TYPE_PROJECTED_CRS) return {};
  // The false easting and northing are lengths, too, and change with the unit.
  const Object parameters(
      proj_crs_alter_parameters_linear_unit(c, horizontal.get(), "metre", 1.0, "EPSG", "9001", /*convert=*/1));
  const Object metric(parameters ? proj_crs_alter_cs_linear_unit(c, parameters.get(), "metre", 1.0, "EPSG", "9001")
                                 : nullptr);
  const char* wkt = metric ? proj_as_wkt(c, metric.get(), PJ_WKT2_2019, nullptr) : nullptr;
  return wkt == nullptr ? std::string() : wkt;
}

}  // namespace

CrsUnits crs_units(const std::string& crs) {
  static Cache<CrsUnits> cache;
  return cache.get(crs, [&] { return parse_units(crs); });
}

std::string crs_in_metres(const std::string& crs) {
  static Cache<std::string> cache;
  return cache.get(crs, [&] { return convert_to_metres(crs); });
}

bool same_horizontal_crs(const std::string& a, const std::string& b) {
  const Context context = quiet_context();
  const auto horizontal = [&](const std::string& crs) {
    const Object whole = parse(context.get(), crs);
    return whole ? part(context.get(), whole.get(), 0) : nullptr;
  };
  const Object first = horizontal(a), second = horizontal(b);
  if (!first || !second) return true;
  return proj_is_equivalent_to_with_ctx(context.get(), first.get(), second.get(),
                                        PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) != 0;
}

}  // namespace btms
