#include "io/crs/crs_units.h"

#include <proj_experimental.h>  // proj_crs_alter_*: "experimental" since PROJ 5, unchanged up to 9

#include <map>
#include <mutex>

#include "io/crs/proj_crs.h"

namespace btms {
namespace {

using Context = ProjContext;
using Object = ProjObject;

// One context a call: PROJ's contexts are not thread-safe.
Context quiet_context() { return quiet_proj_context(); }
Object parse(PJ_CONTEXT* context, const std::string& crs) { return parse_crs(context, crs); }
Object part(PJ_CONTEXT* context, const PJ* crs, int index) { return crs_part(context, crs, index); }

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

std::string wkt_of(PJ_CONTEXT* context, const PJ* crs) {
  const char* text = crs ? proj_as_wkt(context, crs, PJ_WKT2_2019, nullptr) : nullptr;
  return text == nullptr ? std::string() : text;
}

// A vertical system in metres: the registered one of that name where there is one ("NAVD88 height (ftUS)" has).
Object heights_in_metres(PJ_CONTEXT* context, Object vertical) {
  if (unit(context, vertical.get()) == 1) return vertical;
  std::string name = proj_get_name(vertical.get());
  if (const std::size_t bracket = name.find(" ("); bracket != std::string::npos) name.resize(bracket);
  const PJ_TYPE types[] = {PJ_TYPE_VERTICAL_CRS};
  PJ_OBJ_LIST* found = proj_create_from_name(context, "EPSG", name.c_str(), types, 1, 0, 1, nullptr);
  Object registered(found && proj_list_get_count(found) == 1 ? proj_list_get(context, found, 0) : nullptr);
  proj_list_destroy(found);
  if (registered && unit(context, registered.get()) == 1) return registered;
  Object metric(proj_crs_alter_cs_linear_unit(context, vertical.get(), "metre", 1.0, "EPSG", "9001"));
  return metric ? Object(proj_alter_name(context, metric.get(), name.c_str())) : nullptr;
}

// Both parts as one; the horizontal one alone where there is no other.
std::string compound(PJ_CONTEXT* context, PJ* horizontal, PJ* vertical) {
  if (!vertical) return wkt_of(context, horizontal);
  const std::string name = std::string(proj_get_name(horizontal)) + " + " + proj_get_name(vertical);
  const Object both(proj_create_compound_crs(context, name.c_str(), horizontal, vertical));
  return wkt_of(context, both ? both.get() : horizontal);
}

std::string convert_to_metres(const std::string& crs) {
  const Context context = quiet_context();
  PJ_CONTEXT* c = context.get();
  const Object whole = parse(c, crs);
  Object horizontal = whole ? part(c, whole.get(), 0) : nullptr;
  if (!horizontal) return {};
  Object vertical = part(c, whole.get(), 1);
  if (vertical) vertical = heights_in_metres(c, std::move(vertical));
  if (third_unit(c, horizontal.get()) != 0) horizontal.reset(proj_crs_demote_to_2D(c, nullptr, horizontal.get()));
  if (horizontal && unit(c, horizontal.get()) == 1)  // as it stands, with its EPSG code
    return compound(c, horizontal.get(), vertical.get());
  if (!horizontal || proj_get_type(horizontal.get()) != PJ_TYPE_PROJECTED_CRS) return {};
  // The false easting and northing are lengths, too, and change with the unit.
  const Object parameters(
      proj_crs_alter_parameters_linear_unit(c, horizontal.get(), "metre", 1.0, "EPSG", "9001", /*convert=*/1));
  const Object metric(parameters ? proj_crs_alter_cs_linear_unit(c, parameters.get(), "metre", 1.0, "EPSG", "9001")
                                 : nullptr);
  return metric ? compound(c, metric.get(), vertical.get()) : std::string();
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

std::string vertical_system(const std::string& crs) {
  static Cache<std::string> cache;
  return cache.get(crs, [&]() -> std::string {
    const Context context = quiet_context();
    const Object whole = crs.empty() ? nullptr : parse(context.get(), crs);
    if (!whole) return {};
    if (const Object vertical = part(context.get(), whole.get(), 1)) return proj_get_name(vertical.get());
    return third_unit(context.get(), whole.get()) != 0 ? "ellipsoid" : "";
  });
}

std::string with_heights_of(const std::string& of, const std::string& heights) {
  const Context context = quiet_context();
  PJ_CONTEXT* c = context.get();
  const Object first = parse(c, of), second = heights.empty() ? nullptr : parse(c, heights);
  const Object horizontal = first ? plane_part(c, first.get()) : nullptr;
  if (!horizontal) return of;
  if (const Object vertical = second ? part(c, second.get(), 1) : nullptr)
    return compound(c, horizontal.get(), vertical.get());
  if (second && third_unit(c, second.get()) != 0) {
    const Object raised(proj_crs_promote_to_3D(c, nullptr, horizontal.get()));
    return wkt_of(c, raised ? raised.get() : horizontal.get());
  }
  return wkt_of(c, horizontal.get());
}

bool same_horizontal_crs(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const Context context = quiet_context();
  const auto horizontal = [&](const std::string& crs) {
    const Object whole = parse(context.get(), crs);
    return whole ? plane_part(context.get(), whole.get()) : nullptr;
  };
  const Object first = horizontal(a), second = horizontal(b);
  if (!first || !second) return true;
  return proj_is_equivalent_to_with_ctx(context.get(), first.get(), second.get(),
                                        PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) != 0;
}

}  // namespace btms
