#include "engine/terrain/parameters.h"

#include <array>
#include <charconv>
#include <cmath>

#include "engine/error.h"
#include "engine/lattice/lattice.h"

namespace btms {
namespace {

using P = Parameters;

constexpr double kWidestVehicle_r = 32;
constexpr double kMinResolution_m = Lattice::kMinResolution_mm / 1000.0;

const std::array kTable = {
    ParameterInfo{"method", "", "", 0, 0, "fixed|coarse-to-fine", "Eq 1-14 / coarse to fine",
                  "the paper's one lattice (fixed), or levels that are each other's prior (coarse-to-fine)",
                  &P::method},
    ParameterInfo{"levels", "", "", 1, 6, "", "coarse to fine",
                  "most levels there are; resolution_m is the finest, each coarser one doubles it, up to 65.5 m",
                  &P::levels},
    ParameterInfo{"resolution_m", "r^T", "m", kMinResolution_m, 64.0, "", "Table I",
                  "edge of a tri-grid square, an even number of millimetres", &P::resolution_m},
    ParameterInfo{"node_model", "", "", 0, 0, "pca|robust", "Eq 2",
                  "plane of all points of a node (pca), or of its lowest points, refitted (robust)", &P::node_model},
    ParameterInfo{"seed_height_m", "", "m", 0.001, 10.0, "", "robust model",
                  "seeds are the points up to this far above the node's lowest ones", &P::seed_height_m},
    ParameterInfo{"refit_distance_m", "", "m", 0.001, 10.0, "", "robust model",
                  "a refit takes the points up to this far above the plane", &P::refit_distance_m},
    ParameterInfo{"node_weight", "w^T", "", 0, 0, "normalized|predecessor", "Eq 3",
                  "weight of a node's plane at its corners: of the paper (normalized), or of its predecessor",
                  &P::node_weight},
    ParameterInfo{"slope_max_deg", "theta^T", "deg", 0.1, 89.0, "", "Eq 5, Table I",
                  "fixed method: steeper planes are not terrain", &P::slope_max_deg},
    ParameterInfo{"min_points", "sigma^T", "points", 1, 1000000, "", "Eq 5, Table I",
                  "nodes with fewer points are not terrain candidates", &P::min_points},
    ParameterInfo{"normal_similarity", "eps1", "rad/m", 0.0, 1.5, "", "Eq 6, Table I",
                  "how much the normals of linked nodes may differ per metre between them", &P::normal_similarity},
    ParameterInfo{"plane_distance", "eps2", "rad", 0.0, 1.5, "", "Eq 6, Table I",
                  "elevation angle at which a linked node's mean may stand off the other's plane", &P::plane_distance},
    ParameterInfo{"keep_nodes", "", "nodes", 1, 1000000000, "", "measured",
                  "fixed method: connected components with fewer nodes are not terrain", &P::keep_nodes},
    ParameterInfo{
        "completion", "", "", 0, 0, "kernel|none", "Eq 7-11 / coarse to fine",
        "predict nodes that are not terrain from the terrain around them (kernel), or leave them alone (none)",
        &P::completion},
    ParameterInfo{"kernel_radius", "l/r^T", "r", 1.0, 10.0, "", "Eq 7; no value in the paper",
                  "radius of the prediction kernel in units of the resolution", &P::kernel_radius},
    ParameterInfo{"completion_normals", "", "", 0, 0, "faithful|plane", "Eq 9-10",
                  "normals of predicted nodes as printed (faithful), or by weighted least squares (plane)",
                  &P::completion_normals},
    ParameterInfo{"min_support", "", "", 0.0, 1000.0, "", "measured",
                  "a prediction needs more than this sum of kernel values", &P::min_support},
    ParameterInfo{"terrain_distance_m", "eps3", "m", 0.0, 10.0, "", "Eq 14, Table I",
                  "points up to this far above the final plane are terrain", &P::terrain_distance_m},
    ParameterInfo{"below_m", "", "m", 0.0, 1000.0, "", "measured",
                  "points further below the surface than this are flagged as far below", &P::below_m},
    ParameterInfo{"vehicle_width_m", "", "m", 0.0, 100.0, "", "a car",
                  "cost: nothing within half of this from a place may be impassable", &P::vehicle_width_m},
    ParameterInfo{"vehicle_height_m", "", "m", 0.0, 50.0, "", "a car", "cost: less clearance than this is impassable",
                  &P::vehicle_height_m},
    ParameterInfo{"vehicle_max_slope_deg", "", "deg", 0.1, 89.0, "", "a car",
                  "cost: steeper ground than this is impassable", &P::vehicle_max_slope_deg},
    ParameterInfo{"vehicle_max_step_m", "", "m", 0.001, 10.0, "", "a car",
                  "cost: higher steps than this are impassable", &P::vehicle_max_step_m},
    ParameterInfo{"gate_m", "dn0", "m", 0, 100, "", "coarse to fine",
                  "points further below the prior than this (plus gate_per_r) are noise", &P::gate_m},
    ParameterInfo{"gate_per_r", "dn1", "", 0, 10, "", "coarse to fine", "the same per metre of the level's resolution",
                  &P::gate_per_r},
    ParameterInfo{"fit_scale_m", "f0", "m", 0.001, 10, "", "coarse to fine",
                  "residual above the plane at which a point counts half", &P::fit_scale_m},
    ParameterInfo{"fit_scale_slope", "f2", "", 0, 10, "", "coarse to fine",
                  "the same per metre of resolution and unit of slope", &P::fit_scale_slope},
    ParameterInfo{"fit_scale_fine_m", "", "m", 0.001, 10, "", "coarse to fine",
                  "the first of the two on the finest level", &P::fit_scale_fine_m},
    ParameterInfo{"fit_scale_fine_slope", "", "", 0, 10, "", "coarse to fine", "the second on the finest level",
                  &P::fit_scale_fine_slope},
    ParameterInfo{"fit_scale_ground", "", "", 0, 100, "", "coarse to fine",
                  "finest level: at least this times the scatter of the ground there, measured in a round of its own; "
                  "0: no such round",
                  &P::fit_scale_ground},
    ParameterInfo{"fit_scale_last_m", "f_fin", "m", 0.001, 10, "", "coarse to fine",
                  "cap of that scale in the last fit", &P::fit_scale_last_m},
    ParameterInfo{"ridge", "lambda", "", 0.0001, 100, "", "coarse to fine",
                  "pull of the prior's slope on a node's plane", &P::ridge},
    ParameterInfo{"slope_limit", "g_max", "", 0.01, 3.9, "", "coarse to fine", "slopes (tangent) are clamped to this",
                  &P::slope_limit},
    ParameterInfo{"min_weight", "sigma", "points", 0, 1000000, "", "coarse to fine",
                  "sum of point weights a plane needs", &P::min_weight},
    ParameterInfo{"inherit", "u_inh", "", 0, 1, "", "coarse to fine", "share of the prior's uncertainty a fit keeps",
                  &P::inherit},
    ParameterInfo{"first_scale_m", "", "m", 0.001, 10, "", "coarse to fine", "first level: fit scale",
                  &P::first_scale_m},
    ParameterInfo{"first_scale_per_r", "", "", 0, 10, "", "coarse to fine",
                  "first level: fit scale per metre of resolution", &P::first_scale_per_r},
    ParameterInfo{"first_ridge", "", "", 0.0001, 100, "", "coarse to fine", "first level: pull towards the horizontal",
                  &P::first_ridge},
    ParameterInfo{"first_min_weight", "", "points", 0, 1000000, "", "coarse to fine",
                  "first level: sum of point weights a plane needs", &P::first_min_weight},
    ParameterInfo{"first_quantile", "", "", 0, 1, "", "coarse to fine",
                  "first level: height quantile the fit starts from", &P::first_quantile},
    ParameterInfo{"first_gap_m", "", "m", 0, 100, "", "coarse to fine",
                  "first level: points isolated below the rest by more than this are noise", &P::first_gap_m},
    ParameterInfo{"first_gap_per_r", "", "", 0, 10, "", "coarse to fine", "the same per metre of resolution",
                  &P::first_gap_per_r},
    ParameterInfo{"level_rounds", "", "rounds", 1, 9, "", "coarse to fine",
                  "levels between the first and the finest: odd rounds fit and judge, even ones judge anew against the "
                  "new surface",
                  &P::level_rounds},
    ParameterInfo{"near_m", "t0", "m", 0, 100, "", "coarse to fine",
                  "planes further above the prior than this (plus the next four) are above it", &P::near_m},
    ParameterInfo{"near_per_r", "t1", "", 0, 10, "", "coarse to fine", "the same per metre of resolution",
                  &P::near_per_r},
    ParameterInfo{"near_slope", "t2", "", 0, 10, "", "coarse to fine",
                  "the same per metre of resolution and unit of slope", &P::near_slope},
    ParameterInfo{"near_uncertainty", "t3", "", 0, 100, "", "coarse to fine",
                  "the same per metre of the prior's uncertainty", &P::near_uncertainty},
    ParameterInfo{"near_uncertainty_cap_per_r", "", "", 0, 10, "", "coarse to fine",
                  "cap of that uncertainty per metre of resolution", &P::near_uncertainty_cap_per_r},
    ParameterInfo{"link_m", "z0", "m", 0, 100, "", "coarse to fine",
                  "planes of linked nodes differ by less than this halfway between them", &P::link_m},
    ParameterInfo{"link_per_r", "z1", "", 0, 10, "", "coarse to fine", "the same per metre of resolution",
                  &P::link_per_r},
    ParameterInfo{"link_slope", "e_n", "", 0, 10, "", "coarse to fine",
                  "slopes of linked nodes differ by less than this", &P::link_slope},
    ParameterInfo{"link_flat_m", "z_flat", "m", 0, 100, "", "coarse to fine",
                  "nodes whose heights differ by less than this are linked anyway", &P::link_flat_m},
    ParameterInfo{"step_m", "h0", "m", 0, 100, "", "coarse to fine",
                  "an edge of a rim is up when it rises by more than this", &P::step_m},
    ParameterInfo{"step_per_r", "h1", "", 0, 10, "", "coarse to fine", "the same per metre of resolution",
                  &P::step_per_r},
    ParameterInfo{"small_nodes", "k_min", "nodes", 0, 1000000, "", "coarse to fine",
                  "components with fewer nodes are small", &P::small_nodes},
    ParameterInfo{"first_up", "f_0", "", 0, 1, "", "coarse to fine",
                  "components of the first level with a larger share of rim edges up are rejected", &P::first_up},
    ParameterInfo{"near_up", "f_near", "", 0, 1, "", "coarse to fine",
                  "components near the prior with a larger share of rim edges up are rejected", &P::near_up},
    ParameterInfo{"above_up", "f_above", "", 0, 1, "", "coarse to fine", "the same for components above the prior",
                  &P::above_up},
    ParameterInfo{"near_residual", "", "", -10, 10, "", "coarse to fine",
                  "only if their mean height over the prior exceeds this share of the tolerance", &P::near_residual},
    ParameterInfo{"low_residual", "", "", 0, 100, "", "coarse to fine",
                  "small components this many tolerances below the prior are noise", &P::low_residual},
    ParameterInfo{"agree", "a_min", "", 0, 1, "", "coarse to fine",
                  "components above the prior need this share of agreeing rim edges", &P::agree},
    ParameterInfo{"agree_small", "a_small", "", 0, 1, "", "coarse to fine", "small ones need this share",
                  &P::agree_small},
    ParameterInfo{"rejection_rounds", "", "", 1, 100, "", "coarse to fine", "rounds of rejection",
                  &P::rejection_rounds},
    ParameterInfo{"level_kernel_radius", "l", "r", 1, 8, "", "coarse to fine", "radius of the completion kernel",
                  &P::level_kernel_radius},
    ParameterInfo{"shrink", "kappa", "", 0, 100, "", "coarse to fine", "pull of the prior on completed heights",
                  &P::shrink},
    ParameterInfo{"tilt", "", "", 0, 1, "", "coarse to fine", "share of the neighbours' slopes that is extrapolated",
                  &P::tilt},
    ParameterInfo{"first_tilt", "", "", 0, 1, "", "coarse to fine", "the same on the first level", &P::first_tilt},
    ParameterInfo{"completed_weight", "w_b", "", 0, 1, "", "coarse to fine", "weight of completed nodes at the corners",
                  &P::completed_weight},
    ParameterInfo{"least_weight", "", "", 0.0001, 1, "", "coarse to fine", "weight of nodes that only have their prior",
                  &P::least_weight},
    ParameterInfo{"corner_floor_per_r", "", "", 0.0001, 1, "", "coarse to fine",
                  "least distance in corner weights per metre of resolution", &P::corner_floor_per_r},
    ParameterInfo{"label_least_m", "", "m", 0, 10, "", "coarse to fine",
                  "for labels, the ground's points scatter by at least this", &P::label_least_m},
    ParameterInfo{"label_spread", "e3", "", 0, 100, "", "coarse to fine",
                  "points up to this many standard deviations of the ground's own points above it are terrain",
                  &P::label_spread},
    ParameterInfo{"label_disagreement", "", "", 0, 100, "", "coarse to fine",
                  "plus this times what the planes around the place disagree", &P::label_disagreement},
    ParameterInfo{"label_slope", "e_s", "", 0, 100, "", "coarse to fine", "plus this times the same times the slope",
                  &P::label_slope},
    ParameterInfo{"label_uncertainty", "e_u", "", 0, 100, "", "coarse to fine", "plus this times the uncertainty",
                  &P::label_uncertainty},
    ParameterInfo{"label_slope_cap", "", "", 0, 100, "", "coarse to fine", "slopes above this count as this",
                  &P::label_slope_cap},
    ParameterInfo{"level_below_m", "", "m", 0, 1000, "", "coarse to fine",
                  "points further below the surface are flagged as far below", &P::level_below_m},
    ParameterInfo{"sd_observed", "", "", 0, 100, "", "coarse to fine",
                  "standard deviation of seen heights per disagreement of the planes", &P::sd_observed},
    ParameterInfo{"sd_smooth_m", "", "m", 0.001, 10, "", "coarse to fine",
                  "less in proportion where the ground scatters less than this", &P::sd_smooth_m},
    ParameterInfo{"sd_least", "", "", 0, 10, "", "coarse to fine", "but never below this share of the ground's scatter",
                  &P::sd_least},
    ParameterInfo{"sd_inferred", "", "", 0, 100, "", "coarse to fine",
                  "standard deviation of inferred heights per spread of what they come from", &P::sd_inferred},
    ParameterInfo{"filled_m", "", "m", 0.001, 1000, "", "coarse to fine",
                  "heights taken over from levels of this resolution or coarser are called filled", &P::filled_m},
    ParameterInfo{"span_width_m", "", "m", 0, 200, "", "coarse to fine", "bridge decks up to this wide are not terrain",
                  &P::span_width_m},
    ParameterInfo{"span_drop_m", "", "m", 0.5, 100, "", "coarse to fine",
                  "a deck lies at least this high above the ground on both sides", &P::span_drop_m},
    ParameterInfo{"upper_gap_m", "", "m", 0.1, 100, "", "coarse to fine",
                  "room that a further surface (deck, roof, ceiling) leaves over the one below it", &P::upper_gap_m},
    ParameterInfo{"upper_nodes", "", "nodes", 1, 1000000000, "", "coarse to fine",
                  "a further surface has at least this many nodes", &P::upper_nodes},
};

constexpr std::array<std::string_view, 2> kNodeModels = {"pca", "robust"};
constexpr std::array<std::string_view, 2> kMethods = {"fixed", "coarse-to-fine"};
constexpr std::array<std::string_view, 2> kNodeWeights = {"normalized", "predecessor"};
constexpr std::array<std::string_view, 2> kCompletions = {"kernel", "none"};
constexpr std::array<std::string_view, 2> kCompletionNormals = {"faithful", "plane"};

const ParameterInfo& find(std::string_view name) {
  for (const ParameterInfo& info : kTable)
    if (info.name == name) return info;
  throw Error(ErrorCode::kUsage, "unknown parameter '" + std::string(name) + "'; `btms params` lists them all");
}

std::string number_text(double v) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), v).ptr;
  return {text.data(), end};
}

std::string range_text(const ParameterInfo& i) {
  if (!i.choices.empty()) return std::string(i.choices);
  const auto plain = [](double v) {  // a million as people write it
    std::array<char, 32> text{};
    return std::string(text.data(),
                       std::to_chars(text.data(), text.data() + text.size(), v, std::chars_format::fixed).ptr);
  };
  return plain(i.min) + " to " + plain(i.max) + " " + std::string(i.unit);
}

[[noreturn]] void refuse(const ParameterInfo& i, std::string_view text) {
  throw Error(ErrorCode::kUsage,
              "parameter " + std::string(i.name) + " = '" + std::string(text) + "': expected " + range_text(i));
}

template <class Enum, std::size_t N>
Enum choice(const ParameterInfo& info, const std::array<std::string_view, N>& names, std::string_view text) {
  for (std::size_t k = 0; k < N; ++k)
    if (names[k] == text) return static_cast<Enum>(k);
  refuse(info, text);
}

}  // namespace

std::span<const ParameterInfo> parameter_table() { return kTable; }

std::string parameter_text(const Parameters& p, const ParameterInfo& info) {
  struct Visitor {
    const Parameters& p;
    std::string operator()(double P::*f) const { return number_text(p.*f); }
    std::string operator()(int P::*f) const { return std::to_string(p.*f); }
    std::string operator()(NodeModel P::*f) const { return std::string(kNodeModels[static_cast<std::size_t>(p.*f)]); }
    std::string operator()(Method P::*f) const { return std::string(kMethods[static_cast<std::size_t>(p.*f)]); }
    std::string operator()(NodeWeight P::*f) const { return std::string(kNodeWeights[static_cast<std::size_t>(p.*f)]); }
    std::string operator()(Completion P::*f) const { return std::string(kCompletions[static_cast<std::size_t>(p.*f)]); }
    std::string operator()(CompletionNormals P::*f) const {
      return std::string(kCompletionNormals[static_cast<std::size_t>(p.*f)]);
    }
  };
  return std::visit(Visitor{p}, info.field);
}

void set_parameter(Parameters& p, std::string_view name, std::string_view text) {
  const ParameterInfo& info = find(name);
  const auto number = [&]<class T>(T value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) refuse(info, text);
    if (!(static_cast<double>(value) >= info.min && static_cast<double>(value) <= info.max)) refuse(info, text);
    return value;
  };
  struct Visitor {
    Parameters& p;
    const ParameterInfo& info;
    std::string_view text;
    const decltype(number)& parse;
    void operator()(double P::*f) const { p.*f = parse(0.0); }
    void operator()(int P::*f) const { p.*f = parse(0); }
    void operator()(NodeModel P::*f) const { p.*f = choice<NodeModel>(info, kNodeModels, text); }
    void operator()(Method P::*f) const { p.*f = choice<Method>(info, kMethods, text); }
    void operator()(NodeWeight P::*f) const { p.*f = choice<NodeWeight>(info, kNodeWeights, text); }
    void operator()(Completion P::*f) const { p.*f = choice<Completion>(info, kCompletions, text); }
    void operator()(CompletionNormals P::*f) const { p.*f = choice<CompletionNormals>(info, kCompletionNormals, text); }
  };
  std::visit(Visitor{p, info, text, number}, info.field);
}

void check(const Parameters& p) {
  Parameters copy = p;
  for (const ParameterInfo& info : kTable) set_parameter(copy, info.name, parameter_text(p, info));
  const double r_mm = p.resolution_m * 1000.0;
  if (std::floor(r_mm + 0.5) != r_mm && std::abs(std::floor(r_mm + 0.5) - r_mm) > 1e-6)
    throw Error(ErrorCode::kUsage, "resolution_m = " + number_text(p.resolution_m) +
                                       ": expected a whole, even number of millimetres (for example 2 or 0.5)");
  if (resolution_mm(p) % 2 != 0)
    throw Error(ErrorCode::kUsage, "resolution_m = " + number_text(p.resolution_m) +
                                       ": expected an even number of millimetres, so that square centres are whole");
  if (p.vehicle_width_m > kWidestVehicle_r * p.resolution_m)
    throw Error(ErrorCode::kUsage, "vehicle_width_m = " + number_text(p.vehicle_width_m) + ": expected at most " +
                                       number_text(kWidestVehicle_r * p.resolution_m) + " m at " +
                                       number_text(p.resolution_m) + " m resolution");
}

int level_count(const Parameters& p) {
  if (p.method == Method::kFixed) return 1;
  int levels = p.levels;
  while (levels > 1 && std::int64_t{resolution_mm(p)} << (levels - 1) > Lattice::kMaxResolution_mm) --levels;
  return levels;
}

namespace {

// Table I. Parameters{} is its column for single scans.
Parameters paper_partial_map() {
  Parameters p;
  p.resolution_m = 2.0;
  p.terrain_distance_m = 0.3;
  return p;
}

// Airborne maps, coarse to fine; `--method fixed --resolution 8` is the paper on them.
Parameters city() {
  Parameters p;
  p.method = Method::kCoarseToFine;
  p.levels = 5;
  p.resolution_m = 2.0;
  p.seed_height_m = 0.25;
  p.refit_distance_m = 0.125;
  p.kernel_radius = 2.0;
  p.completion_normals = CompletionNormals::kPlane;  // hills: the printed normals flatten every slope
  p.terrain_distance_m = 0.3;
  return p;
}

// A scanner on the ground, coarse to fine: centimetres of noise where an airborne survey has decimetres, so thresholds
// are tighter than those of city().
Parameters ground_scanner() {
  Parameters p;
  p.method = Method::kCoarseToFine;
  p.levels = 6;
  p.resolution_m = 1.0;
  // Fit: planes hang on a few centimetres of ground, more where the ground scatters more.
  p.fit_scale_m = 0.03;
  p.fit_scale_slope = 0.02;
  p.fit_scale_fine_m = 0.02;
  p.fit_scale_ground = 2;
  p.ridge = 0.6;
  p.min_weight = 1.5;
  p.inherit = 0.2;
  p.level_rounds = 1;  // more of them: nothing measured, and scans have no time for it
  // Near, links and rims
  p.near_m = 0.05;
  p.near_per_r = 0.055;
  p.near_slope = 0;
  p.near_uncertainty = 0.4;
  p.near_residual = -10;
  p.link_m = 0.085;
  p.link_per_r = 0.02;
  p.link_flat_m = 0.05;
  p.step_m = 0.1;
  p.step_per_r = 0.01;
  // Completion
  p.level_kernel_radius = 3;
  p.completed_weight = 0.25;
  p.span_width_m = 0;  // the same
  // Label
  p.label_least_m = 0.03;
  p.label_spread = 2;
  p.label_uncertainty = 0.95;
  return p;
}

// For costs.
void set_field_robot(Parameters& p) {
  p.vehicle_width_m = 0.8;
  p.vehicle_height_m = 1.2;
  p.vehicle_max_slope_deg = 25.0;
  p.vehicle_max_step_m = 0.15;
}

}  // namespace

std::vector<std::string> preset_names() {
  return {"city", "paper-partial-map", "paper-single-scan", "partial-map", "single-scan"};
}

Parameters preset(std::string_view name) {
  if (name == "city") return city();
  if (name == "paper-single-scan") return {};
  if (name == "paper-partial-map") {
    Parameters p = paper_partial_map();
    set_field_robot(p);
    return p;
  }
  if (name == "single-scan") return ground_scanner();
  if (name == "partial-map") {
    Parameters p = ground_scanner();
    set_field_robot(p);
    return p;
  }
  std::string names;
  for (const std::string& known : preset_names()) names += (names.empty() ? "" : ", ") + known;
  throw Error(ErrorCode::kUsage, "unknown preset '" + std::string(name) + "'; there are " + names);
}

std::int32_t resolution_mm(const Parameters& p) {
  return static_cast<std::int32_t>(std::floor(p.resolution_m * 1000.0 + 0.5));
}

}  // namespace btms
