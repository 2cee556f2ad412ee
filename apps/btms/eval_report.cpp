#include "apps/btms/eval_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "apps/btms/report.h"

namespace btms {
namespace {

constexpr std::size_t kFilesShown = 40;  // --json lists them all

struct Metric {
  const char* key;
  const char* title;
  double (Confusion::*value)() const;
};
constexpr Metric kMetrics[] = {
    {"precision", "precision", &Confusion::precision},
    {"recall", "recall", &Confusion::recall},
    {"f1", "F1", &Confusion::f1},
    {"accuracy", "accuracy", &Confusion::accuracy},
    {"type1", "type I", &Confusion::type1},
    {"type2", "type II", &Confusion::type2},
    {"total_error", "total", &Confusion::total_error},
    {"kappa", "kappa", &Confusion::kappa},
};
using Part = Confusion Scores::*;

MeanDeviation over_files(const std::vector<EvalResult>& results, Part part, const Metric& metric) {
  std::vector<double> values;
  for (const EvalResult& r : results) values.push_back(((r.scores.*part).*metric.value)());
  return mean_deviation(values);
}

Confusion pooled(const std::vector<EvalResult>& results, Part part) {
  Confusion sum;
  for (const EvalResult& r : results) sum += r.scores.*part;
  return sum;
}

std::map<std::uint32_t, ClassCount> all_classes(const std::vector<EvalResult>& results) {
  std::map<std::uint32_t, ClassCount> sum;
  for (const EvalResult& r : results)
    for (const auto& [id, count] : r.classes) {
      sum[id].points += count.points;
      sum[id].terrain += count.terrain;
    }
  return sum;
}

double share(const ClassCount& c) {
  return c.points == 0 ? 0 : static_cast<double>(c.terrain) / static_cast<double>(c.points);
}

const char* role(std::uint32_t id, const TruthRules& rules) {
  const auto in = [&](const std::vector<std::uint32_t>& list) {
    return std::find(list.begin(), list.end(), id) != list.end();
  };
  if (in(rules.terrain)) return "terrain";
  if (in(rules.ignored)) return "ignored";
  if (in(rules.ambiguous)) return "ambiguous";
  if (in(rules.decided_terrain)) return "ambiguous, terrain";
  if (in(rules.decided_object)) return "ambiguous, object";
  return "object";
}

std::vector<std::string> row_of(const std::string& name, const Confusion& c) {
  std::vector<std::string> row{name, grouped(c.total())};
  for (const Metric& metric : kMetrics) row.push_back(percent_text((c.*metric.value)()));
  return row;
}

void print_table(const std::vector<EvalResult>& results, Part part) {
  TextTable table;
  std::vector<std::string> head{"file", "points"}, mean{"mean", ""}, deviation{"deviation", ""};
  for (const Metric& metric : kMetrics) {
    head.push_back(metric.title);
    const MeanDeviation m = over_files(results, part, metric);
    mean.push_back(percent_text(m.mean));
    deviation.push_back(percent_text(m.deviation));
  }
  table.row(head);
  for (std::size_t i = 0; i < std::min(results.size(), kFilesShown); ++i)
    table.row(row_of(results[i].name, results[i].scores.*part));
  if (results.size() > kFilesShown) table.row({fmt::format("... {} more", results.size() - kFilesShown)});
  if (results.size() > 1) {
    table.row(mean);
    table.row(deviation);
    table.row(row_of("all points", pooled(results, part)));
  }
  table.print();
}

Json confusion_json(const Confusion& c) {
  Json json{{"true_positive", c.true_positive},
            {"false_positive", c.false_positive},
            {"false_negative", c.false_negative},
            {"true_negative", c.true_negative}};
  for (const Metric& metric : kMetrics) json[metric.key] = (c.*metric.value)();
  return json;
}

Json part_json(const std::vector<EvalResult>& results, Part part) {
  Json json, mean, deviation;
  for (const Metric& metric : kMetrics) {
    const MeanDeviation m = over_files(results, part, metric);
    mean[metric.key] = m.mean;
    deviation[metric.key] = m.deviation;
  }
  json["mean"] = mean;
  json["deviation"] = deviation;
  json["pooled"] = confusion_json(pooled(results, part));
  return json;
}

}  // namespace

void print_eval_text(const std::vector<EvalResult>& results, const TruthRules& rules, bool per_class) {
  std::uint64_t left_out = 0;
  for (const EvalResult& r : results) left_out += r.left_out;
  const bool decided = !rules.decided_terrain.empty() || !rules.decided_object.empty();
  const bool by_height = rules.sensor_height_m > 0 && !rules.ambiguous.empty();
  if (by_height)
    print_line(
        fmt::format("With the ambiguous classes (terrain below {:.3f} m), in percent", -0.25 * rules.sensor_height_m));
  else if (decided)
    print_line("With the ambiguous classes, as decided scan by scan, in percent");
  else
    print_line(rules.ambiguous.empty() ? "In percent" : "Without the ambiguous classes, in percent");
  print_table(results, &Scores::with);
  if (by_height || decided) {
    print_line("\nWithout the ambiguous classes, in percent");
    print_table(results, &Scores::without);
  }
  if (left_out > 0) print_line(fmt::format("{} points without a prediction left out", grouped(left_out)));
  if (!per_class) return;
  TextTable table;
  table.row({"class", "counts as", "points", "called terrain"});
  for (const auto& [id, count] : all_classes(results))
    table.row({std::to_string(id), role(id, rules), grouped(count.points), percent_text(share(count)) + " %"});
  print_line("");
  table.print();
}

void print_eval_json(const std::vector<EvalResult>& results, const TruthRules& rules) {
  Json json;
  json["files"] = Json::array();
  for (const EvalResult& r : results) {
    Json file{{"name", r.name}, {"points", r.points}, {"left_out", r.left_out}};
    file["with_ambiguous"] = confusion_json(r.scores.with);
    file["without_ambiguous"] = confusion_json(r.scores.without);
    json["files"].push_back(file);
  }
  json["with_ambiguous"] = part_json(results, &Scores::with);
  json["without_ambiguous"] = part_json(results, &Scores::without);
  json["classes"] = Json::array();
  for (const auto& [id, count] : all_classes(results))
    json["classes"].push_back(
        {{"class", id}, {"counts_as", role(id, rules)}, {"points", count.points}, {"called_terrain", count.terrain}});
  json["rules"] = {{"terrain", rules.terrain},
                   {"ignored", rules.ignored},
                   {"ambiguous", rules.ambiguous},
                   {"decided_terrain", rules.decided_terrain},
                   {"decided_object", rules.decided_object},
                   {"sensor_height_m", rules.sensor_height_m}};
  print_json(json);
}

}  // namespace btms
