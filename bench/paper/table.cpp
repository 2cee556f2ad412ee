#include "bench/paper/table.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>

namespace btms::bench {
void print_block(const PaperBlock& block) {
  std::string text =
      fmt::format("\n| {} | P w/ | R w/ | F1 w/ | A w/ | P w/o | R w/o | F1 w/o | A w/o | ms | Hz |\n", block.title);
  text += "|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const PaperRow& row : block.rows) {
    text += "| " + row.method;
    for (const ScorePart& part : kScoreParts)
      for (const PaperMetric& metric : kPaperMetrics) {
        const MeanDeviation m = over_files(row.clouds, part.value, metric.value);
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
    for (const ScorePart& part : kScoreParts)
      for (const PaperMetric& metric : kPaperMetrics) {
        const MeanDeviation m = over_files(row.clouds, part.value, metric.value);
        object[part.key][metric.key] = {{"mean", m.mean}, {"deviation", m.deviation}};
      }
    const MeanDeviation seconds = mean_deviation(row.seconds);
    object["seconds"] = {{"mean", seconds.mean}, {"deviation", seconds.deviation}};
    json["rows"].push_back(object);
  }
  return json;
}

}  // namespace btms::bench
