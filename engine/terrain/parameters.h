// Every number of the method, once: symbol, unit, range, default and source. The command line, the configuration file,
// the manifest and `btms params` are all made from this table, so they can't drift apart.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/terrain/level_parameters.h"

namespace btms {

enum class NodeModel : std::uint8_t {
  kPca,     // Eq 2 literally: the plane of all points of the node
  kRobust,  // the plane of its lowest points, refitted (the practice of the paper's predecessor)
};
enum class NodeWeight : std::uint8_t {
  kNormalized,   // Eq 3: scattering and planarity, at most 1
  kPredecessor,  // (l1 + l2) l2 / (l1 l3 + 0.001), eigenvalues in m^2: unbounded, stored over 4 r^4 (r in metres)
};
enum class CompletionNormals : std::uint8_t {
  kFaithful,  // Eq 9-10: each neighbour proposes the normal perpendicular to the line to it; flattens slopes
  kPlane,     // weighted least squares over the same neighbours; exact on a plane
};

enum class Method : std::uint8_t {
  kFixed,         // the paper: one lattice, Eq 1-14
  kCoarseToFine,  // levels of halving resolution, each the prior of the next (docs/accuracy.md)
};

struct Parameters : LevelParameters {
  Method method = Method::kFixed;
  int levels = 1;  // coarse to fine: resolution_m is the finest level's
  // Lattice and node model (Eq 1-5)
  double resolution_m = 4.0;  // r^T
  NodeModel node_model = NodeModel::kRobust;
  double seed_height_m = 0.15;     // robust: seeds reach this far above the node's lowest points
  double refit_distance_m = 0.08;  // robust: a refit takes points up to this far above the plane
  NodeWeight node_weight = NodeWeight::kNormalized;
  double slope_max_deg = 20.0;  // theta^T, Eq 5
  int min_points = 10;          // sigma^T, Eq 5
  // Links and components (Eq 6)
  double normal_similarity = 0.03;  // eps1: rad per metre of distance
  double plane_distance = 0.1;      // eps2: rad, elevation of the neighbour's mean above the plane
  int keep_nodes = 10;              // components with fewer nodes are not terrain
  // Completion (Eq 7-11)
  double kernel_radius = 3.0;  // l in units of r
  CompletionNormals completion_normals = CompletionNormals::kFaithful;
  double min_support = 0.05;  // a prediction needs more than this sum of kernel values
  // Segmentation (Eq 14)
  double terrain_distance_m = 0.125;  // eps3
  double below_m = 2.0;               // points further below the surface than this are flagged

  // The vehicle that costs are for: a car
  double vehicle_width_m = 1.8;
  double vehicle_height_m = 2.0;
  double vehicle_max_slope_deg = 20.0;
  double vehicle_max_step_m = 0.2;

  friend bool operator==(const Parameters&, const Parameters&) = default;
};

// One row of the table.
struct ParameterInfo {
  std::string_view name;    // the command line's --name-with-dashes, the YAML key with underscores
  std::string_view symbol;  // the paper's symbol, or ""
  std::string_view unit;
  double min, max;           // inclusive range for numbers
  std::string_view choices;  // "a|b" for enumerations, else ""
  std::string_view source;   // equation, table or measurement the default comes from
  std::string_view help;
  std::variant<double Parameters::*, int Parameters::*, NodeModel Parameters::*, CompletionNormals Parameters::*,
               Method Parameters::*, NodeWeight Parameters::*, Completion Parameters::*>
      field;
};

std::span<const ParameterInfo> parameter_table();

// Value as text ("0.125", "robust"); the shortest text that reads back equal.
std::string parameter_text(const Parameters& p, const ParameterInfo& info);
// Sets a value from text. Throws Error(kUsage) naming the parameter and its range.
void set_parameter(Parameters& p, std::string_view name, std::string_view text);
// Checks ranges and the rules between fields (r an even number of millimetres). Throws Error(kUsage).
void check(const Parameters& p);

// Names: city (airborne maps); single-scan and partial-map (scanners on the ground); paper-single-scan and
// paper-partial-map (the paper's Table I, to the letter).
std::vector<std::string> preset_names();
// Throws Error(kUsage) naming the presets there are.
Parameters preset(std::string_view name);

// r in integer millimetres (of the finest level). Precondition: check(p) passed.
std::int32_t resolution_mm(const Parameters& p);
// Levels the map is built in: 1 for the fixed method; coarse to fine p.levels, or as many as leave the coarsest lattice
// a resolution that a lattice can have.
int level_count(const Parameters& p);

}  // namespace btms
