#include "bench/paper/table.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>

namespace btms::bench {
namespace {

struct Metric {
  const char* key;
  double (Confusion::*value)() const;
};
constexpr Metric kMetrics[] = {{"precision", &Confusion::precision},
                               {"recall", &Confusion::recall},
                               {"f1", &Confusion::f1},
                               {"accuracy", &Confusion::accuracy}};
struct Part {
  const char* key;
  Confusion Scores::*value;
};
constexpr Part kParts[] = {{"with_ambiguous", &Scores::with}, {"without_ambiguous", &Scores::without}};

MeanDeviation over_clouds(const PaperRow& row, const Part& part, const Metric& metric) {
  std::vector<double> values;
  for (const Scores& scores : row.clouds) values.push_back(((scores.*part.value).*metric.value)());
  return mean_deviation(values);
}

}  // namespace

void print_block(const PaperBlock& block) {
  std::string text =
      fmt::format("\n| {} | P w/ | R w/ | F1 w/ | A w/ | P w/o | R w/o | F1 w/o | A w/o | ms | Hz |\n", block.title);
  text += "|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const PaperRow& row : block.rows) {
    text += "| " + row.method;
    for (const Part& part : kParts)
      for (const Metric& metric : kMetrics) {
        const MeanDeviation m = over_clouds(row, part, metric);
        text += fmt::format(" | {:.1f} ± {:.1f}", 100 * m.mean, 100 * m.deviation);
      }
    const double seconds = mean_deviation(row.seconds).mean;
    text += fmt::format(" | {:.1f} | {:.0f} |\n", 1000 * seconds, 1 / seconds);
  }
  std::fputs(text.c_str(), stdout);
}

nlohmann::ordered_json to_json(const PaperBlock& block) {
  nlohmann::ordered_json json{{"data", block.title}, {"rows", nlohmann::ordered_json::array()}};
  for (const PaperRow& row : block.rows) {
    nlohmann::ordered_json object{{"method", row.method}, {"clouds", row.clouds.size()}};
    for (const Part& part : kParts)
      for (const Metric& metric : kMetrics) {
        const MeanDeviation m = over_clouds(row, part, metric);
        object[part.key][metric.key] = {{"mean", m.mean}, {"deviation", m.deviation}};
      }
    const MeanDeviation seconds = mean_deviation(row.seconds);
    object["seconds"] = {{"mean", seconds.mean}, {"deviation", seconds.deviation}};
    json["rows"].push_back(object);
  }
  return json;
}

}  // namespace btms::bench
