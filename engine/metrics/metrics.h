// Scores of a segmentation against truth.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace btms {

// Counts over points; "positive" is terrain.
struct Confusion {
  std::uint64_t true_positive = 0, false_positive = 0, false_negative = 0, true_negative = 0;

  Confusion& operator+=(const Confusion& o);
  std::uint64_t total() const { return true_positive + false_positive + false_negative + true_negative; }
  // Ratios in [0, 1]; 0 where the denominator is 0.
  double precision() const;
  double recall() const;
  double f1() const;
  double accuracy() const;
  double type1() const;        // terrain called object / terrain
  double type2() const;        // object called terrain / object
  double total_error() const;  // wrong / all
  double kappa() const;        // Cohen's kappa
};

// How true classes count (paper III-C, "Evaluation Metrics").
struct TruthRules {
  std::vector<std::uint32_t> terrain;  // classes that are terrain
  std::vector<std::uint32_t> ignored;  // classes left out altogether
  std::vector<std::uint32_t>
      ambiguous;               // vegetation, bush: terrain only below -0.25 h_s ("with"), or left out ("without")
  double sensor_height_m = 0;  // h_s; 0 = the ambiguous classes are left out in both
  // Ambiguous as well, but what they are "with" was decided scan by scan, where the sensor was still known.
  std::vector<std::uint32_t> decided_terrain = {}, decided_object = {};
};

// SemanticKITTI: terrain 40 44 48 49 60 72, ambiguous 70, ignored 0 1, h_s = 1.73 m.
TruthRules semantic_kitti_rules();
// RELLIS-3D: terrain 1 3 10 15 23 31 33 34 (dirt, which the paper doesn't list, grass, asphalt, log, concrete, puddle,
// mud, rubble), ambiguous 19 (bush), ignored 0; h_s = 1.2 m, roughly: the paper gives none.
TruthRules rellis_rules();
// What `btms accumulate` writes, LAS: terrain 2, object 1, ignored 0 7; ambiguous and decided per scan: 3 terrain,
// 5 object.
TruthRules partial_map_rules();
// ASPRS LAS: terrain 2; ignored 7 9 17 18 20 26 (water, bridge decks, noise, reserved).
TruthRules asprs_rules();

// kitti, rellis, asprs, partial-map.
std::vector<std::string> label_map_names();
// Throws Error(kUsage) naming the label maps there are.
TruthRules rules_of_label_map(std::string_view name);

// True for classes that count "with" only.
bool is_ambiguous(std::uint32_t truth, const TruthRules& rules);

// What became of one point.
enum class Verdict : std::uint8_t {
  kLeftOut,  // its class doesn't count
  kTerrain,  // rightly called terrain
  kObject,   // rightly called object
  kTypeOne,  // terrain called object
  kTypeTwo,  // object called terrain
};
// `z_m`, in the sensor frame, matters to the ambiguous classes only.
Verdict verdict(std::uint32_t truth, bool terrain, double z_m, const TruthRules& rules);

struct Scores {
  Confusion with;     // the ambiguous classes counted by their height
  Confusion without;  // the ambiguous classes left out
};

// `truth[i]` is a class, `terrain[i]` the prediction, `z_m[i]` the height in the sensor frame (may be empty when
// rules.sensor_height_m is 0). All spans have equal length.
Scores score(std::span<const std::uint32_t> truth, std::span<const std::uint8_t> terrain, std::span<const float> z_m,
             const TruthRules& rules);

// Mean and standard deviation (population) over several files.
struct MeanDeviation {
  double mean = 0, deviation = 0;
};
MeanDeviation mean_deviation(std::span<const double> values);

// The paper's four metrics, in its order, and the two ways it counts.
struct PaperMetric {
  const char* key;
  double (Confusion::*value)() const;
};
inline constexpr PaperMetric kPaperMetrics[] = {{"precision", &Confusion::precision},
                                                {"recall", &Confusion::recall},
                                                {"f1", &Confusion::f1},
                                                {"accuracy", &Confusion::accuracy}};
struct ScorePart {
  const char* key;
  Confusion Scores::*value;
};
inline constexpr ScorePart kScoreParts[] = {{"with_ambiguous", &Scores::with}, {"without_ambiguous", &Scores::without}};

// Of one metric over several files.
MeanDeviation over_files(std::span<const Scores> files, Confusion Scores::*part, double (Confusion::*metric)() const);

}  // namespace btms
