#include "engine/metrics/metrics.h"

#include <algorithm>
#include <cmath>

#include "engine/error.h"

namespace btms {
namespace {

double ratio(double part, double whole) { return whole == 0 ? 0 : part / whole; }
double count(std::uint64_t n) { return static_cast<double>(n); }

void tally(Confusion& c, Verdict v) {
  c.true_positive += v == Verdict::kTerrain;
  c.false_positive += v == Verdict::kTypeTwo;
  c.false_negative += v == Verdict::kTypeOne;
  c.true_negative += v == Verdict::kObject;
}

bool holds(const std::vector<std::uint32_t>& classes, std::uint32_t label) {
  return std::find(classes.begin(), classes.end(), label) != classes.end();
}

}  // namespace

Confusion& Confusion::operator+=(const Confusion& o) {
  true_positive += o.true_positive;
  false_positive += o.false_positive;
  false_negative += o.false_negative;
  true_negative += o.true_negative;
  return *this;
}

double Confusion::precision() const { return ratio(count(true_positive), count(true_positive + false_positive)); }
double Confusion::recall() const { return ratio(count(true_positive), count(true_positive + false_negative)); }
double Confusion::f1() const {
  return ratio(2 * count(true_positive), 2 * count(true_positive) + count(false_positive) + count(false_negative));
}
double Confusion::accuracy() const { return ratio(count(true_positive + true_negative), count(total())); }
double Confusion::type1() const { return ratio(count(false_negative), count(true_positive + false_negative)); }
double Confusion::type2() const { return ratio(count(false_positive), count(false_positive + true_negative)); }
double Confusion::total_error() const { return ratio(count(false_positive + false_negative), count(total())); }

double Confusion::kappa() const {
  const double tp = count(true_positive), fp = count(false_positive), fn = count(false_negative),
               tn = count(true_negative), all = count(total());
  // (observed - chance) / (1 - chance), times all^2 above and below.
  const double chance = (tp + fp) * (tp + fn) + (tn + fn) * (tn + fp);
  return ratio((tp + tn) * all - chance, all * all - chance);
}

TruthRules semantic_kitti_rules() {
  return {.terrain = {40, 44, 48, 49, 60, 72}, .ignored = {0, 1}, .ambiguous = {70}, .sensor_height_m = 1.73};
}

TruthRules rellis_rules() {
  return {.terrain = {1, 3, 10, 15, 23, 31, 33, 34}, .ignored = {0}, .ambiguous = {19}, .sensor_height_m = 1.2};
}

TruthRules partial_map_rules() {
  return {.terrain = {2}, .ignored = {0, 7}, .ambiguous = {}, .decided_terrain = {3}, .decided_object = {5}};
}

TruthRules asprs_rules() {
  return {.terrain = {2}, .ignored = {7, 9, 17, 18, 20, 26}, .ambiguous = {}, .sensor_height_m = 0};
}

std::vector<std::string> label_map_names() { return {"kitti", "rellis", "asprs", "partial-map"}; }

TruthRules rules_of_label_map(std::string_view name) {
  if (name == "kitti") return semantic_kitti_rules();
  if (name == "rellis") return rellis_rules();
  if (name == "asprs") return asprs_rules();
  if (name == "partial-map") return partial_map_rules();
  throw Error(ErrorCode::kUsage,
              "unknown label map '" + std::string(name) + "'; there are kitti, rellis, asprs and partial-map");
}

bool is_ambiguous(std::uint32_t truth, const TruthRules& rules) {
  return holds(rules.ambiguous, truth) || holds(rules.decided_terrain, truth) || holds(rules.decided_object, truth);
}

Verdict verdict(std::uint32_t truth, bool terrain, double z_m, const TruthRules& rules) {
  if (holds(rules.ignored, truth)) return Verdict::kLeftOut;
  const bool ambiguous = holds(rules.ambiguous, truth);
  if (ambiguous && rules.sensor_height_m <= 0) return Verdict::kLeftOut;
  const bool positive = ambiguous ? z_m < -0.25 * rules.sensor_height_m
                                  : holds(rules.terrain, truth) || holds(rules.decided_terrain, truth);
  if (positive) return terrain ? Verdict::kTerrain : Verdict::kTypeOne;
  return terrain ? Verdict::kTypeTwo : Verdict::kObject;
}

Scores score(std::span<const std::uint32_t> truth, std::span<const std::uint8_t> terrain, std::span<const float> z_m,
             const TruthRules& rules) {
  Scores scores;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Verdict v = verdict(truth[i], terrain[i] != 0, z_m.empty() ? 0 : static_cast<double>(z_m[i]), rules);
    tally(scores.with, v);
    if (!is_ambiguous(truth[i], rules)) tally(scores.without, v);
  }
  return scores;
}

MeanDeviation mean_deviation(std::span<const double> values) {
  if (values.empty()) return {};
  const auto n = static_cast<double>(values.size());
  double mean = 0, square = 0;
  for (const double v : values) mean += v;
  mean /= n;
  for (const double v : values) square += (v - mean) * (v - mean);
  return {mean, std::sqrt(square / n)};
}

MeanDeviation over_files(std::span<const Scores> files, Confusion Scores::*part, double (Confusion::*metric)() const) {
  std::vector<double> values;
  for (const Scores& scores : files) values.push_back(((scores.*part).*metric)());
  return mean_deviation(values);
}

}  // namespace btms
