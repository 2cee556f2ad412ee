#include "engine/terrain/parameters.h"

#include <array>
#include <charconv>
#include <cmath>

#include "engine/error.h"
#include "engine/lattice/lattice.h"

namespace btms {
namespace {

using P = Parameters;

constexpr double kMinResolution_m = Lattice::kMinResolution_mm / 1000.0;

const std::array kTable = {
    ParameterInfo{"resolution_m", "r^T", "m", kMinResolution_m, 64.0, "", "Table I",
                  "edge of a tri-grid square, an even number of millimetres", &P::resolution_m},
    ParameterInfo{"node_model", "", "", 0, 0, "pca|robust", "Eq 2",
                  "plane of all points of a node (pca), or of its lowest points, refitted (robust)", &P::node_model},
    ParameterInfo{"seed_height_m", "", "m", 0.001, 10.0, "", "robust model",
                  "seeds are the points up to this far above the node's lowest ones", &P::seed_height_m},
    ParameterInfo{"refit_distance_m", "", "m", 0.001, 10.0, "", "robust model",
                  "a refit takes the points up to this far above the plane", &P::refit_distance_m},
    ParameterInfo{"slope_max_deg", "theta^T", "deg", 0.1, 89.0, "", "Eq 5, Table I", "steeper planes are not terrain",
                  &P::slope_max_deg},
    ParameterInfo{"min_points", "sigma^T", "points", 1, 1000000, "", "Eq 5, Table I",
                  "nodes with fewer points are not terrain candidates", &P::min_points},
    ParameterInfo{"normal_similarity", "eps1", "rad/m", 0.0, 1.5, "", "Eq 6, Table I",
                  "how much the normals of linked nodes may differ per metre between them", &P::normal_similarity},
    ParameterInfo{"plane_distance", "eps2", "rad", 0.0, 1.5, "", "Eq 6, Table I",
                  "elevation angle at which a linked node's mean may stand off the other's plane", &P::plane_distance},
    ParameterInfo{"keep_nodes", "", "nodes", 1, 1000000000, "", "measured",
                  "connected components with fewer nodes are not terrain", &P::keep_nodes},
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
};

constexpr std::array<std::string_view, 2> kNodeModels = {"pca", "robust"};
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
  return i.choices.empty() ? number_text(i.min) + " to " + number_text(i.max) + " " + std::string(i.unit)
                           : std::string(i.choices);
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
}

std::vector<std::string> preset_names() { return {"city", "partial-map", "single-scan"}; }

Parameters preset(std::string_view name) {
  Parameters p;  // single-scan: Table I
  if (name == "single-scan") return p;
  if (name == "partial-map") {  // Table I
    p.resolution_m = 2.0;
    p.terrain_distance_m = 0.3;
    return p;
  }
  if (name == "city") {  // one fixed resolution for airborne maps
    p.resolution_m = 8.0;
    p.seed_height_m = 0.25;
    p.refit_distance_m = 0.125;
    p.kernel_radius = 2.0;
    p.completion_normals = CompletionNormals::kPlane;  // hills: the printed normals flatten every slope
    p.terrain_distance_m = 0.3;
    return p;
  }
  throw Error(ErrorCode::kUsage,
              "unknown preset '" + std::string(name) + "'; there are city, partial-map and single-scan");
}

std::int32_t resolution_mm(const Parameters& p) {
  return static_cast<std::int32_t>(std::floor(p.resolution_m * 1000.0 + 0.5));
}

}  // namespace btms
