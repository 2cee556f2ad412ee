// Numbers of the coarse-to-fine method (docs/accuracy.md). Slopes are tangents, lengths metres; "per r" multiplies the
// level's resolution in metres.
#pragma once

#include <cstdint>

namespace btms {

// Of both methods.
enum class Completion : std::uint8_t {
  kKernel,  // nodes that are not terrain are predicted from those around them that are
  kNone,    // they are left alone, as by the paper's predecessor
};

struct LevelParameters {
  Completion completion = Completion::kKernel;
  // Gate and fit
  double gate_m = 1.0, gate_per_r = 0.3;                        // dn0, dn1: points further below the prior are noise
  double fit_scale_m = 0.1, fit_scale_slope = 0.05;             // f0, f2: scale s of the reweighting
  double fit_scale_fine_m = 0.06, fit_scale_fine_slope = 0.02;  // the same on the finest level
  double fit_scale_ground = 0;     // there, where it is more: the same per scatter of the ground; 0: not looked at
  double fit_scale_last_m = 0.15;  // f_fin: cap of s in the last fit
  double ridge = 0.05;             // lambda: pull of the prior's slope
  double slope_limit = 1.0;        // g_max: slopes of prior and fit are clamped to it
  double min_weight = 0.9;         // sigma: sum of weights a plane needs
  double inherit = 0.7;            // u_inh: share of the prior's uncertainty a fit keeps
  // First level
  double first_scale_m = 0.4, first_scale_per_r = 0.03;
  double first_ridge = 0.02;
  double first_min_weight = 5;
  double first_quantile = 0.02;
  double first_gap_m = 2, first_gap_per_r = 0.1;  // points isolated below the rest by more than this are noise
  int level_rounds = 3;  // of the levels between the first and the finest: fit, judge anew, fit again
  // Near or above the prior
  double near_m = 0.4, near_per_r = 0.03, near_slope = 0.2, near_uncertainty = 2, near_uncertainty_cap_per_r = 0.1;
  // Links and rims
  double link_m = 0.5, link_per_r = 0.03;                 // z0, z1
  double link_slope = 0.5;                                // e_n
  double link_flat_m = 0.3;                               // z_flat
  double step_m = 0.5, step_per_r = 0.05;                 // h0, h1
  int small_nodes = 10;                                   // k_min
  double first_up = 0.35, near_up = 0.5, above_up = 0.6;  // f_0, f_near, f_above
  double near_residual = 0.5;             // near components are rejected only if sum d > this share of sum t
  double low_residual = 2;                // small near components with sum d < -this sum t are low noise
  double agree = 0.1, agree_small = 0.3;  // a_min, a_small
  int rejection_rounds = 4;
  // Completion
  double level_kernel_radius = 2.5;     // l in r
  double shrink = 0.02;                 // kappa
  double tilt = 0.1, first_tilt = 0.5;  // share of the neighbours' planes that is extrapolated
  double completed_weight = 0.03;       // w_b
  double least_weight = 0.001;
  double corner_floor_per_r = 0.05;  // distance floor of corner weights
  // Label
  double label_least_m = 0.045, label_spread = 2.5, label_disagreement = 0.8, label_slope = 4, label_uncertainty = 0.7;
  double label_slope_cap = 2;
  double level_below_m = 3;
  // Standard deviations
  double sd_observed = 1.95, sd_smooth_m = 0.04, sd_least = 0.2;
  double sd_inferred = 3.8;
  double filled_m = 16;  // heights from levels this coarse are a guess
  // Bridges
  double span_width_m = 30;  // of a deck, at most; 0: none are looked for
  double span_drop_m = 3;    // from a deck to the ground beside it, at least
  // Further surfaces
  double upper_gap_m = 1.8;  // room between two surfaces
  int upper_nodes = 20;      // a further surface has at least this many nodes

  friend bool operator==(const LevelParameters&, const LevelParameters&) = default;
};

}  // namespace btms
