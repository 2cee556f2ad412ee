#include "apps/btms/sweep_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "apps/btms/report.h"
#include "io/files/atomic_file.h"

namespace btms {
namespace {

const char* completion_text(Completion c) { return c == Completion::kKernel ? "kernel" : "none"; }

std::string mean_text(const MeanDeviation& m) {
  return fmt::format("{} ± {}", percent_text(m.mean), percent_text(m.deviation));
}

}  // namespace

std::vector<std::string> Sweep::parameters() const {
  std::vector<std::string> names;
  for (const SweepRow& row : rows)
    if (std::find(names.begin(), names.end(), row.parameter) == names.end()) names.push_back(row.parameter);
  return names;
}

std::optional<double> Sweep::spread(const std::string& parameter, Completion completion) const {
  std::vector<double> values;
  for (const SweepRow& row : rows)
    if (row.parameter == parameter && row.completion == completion) values.push_back(row.accuracy(&Scores::without));
  if (values.size() < 2) return {};
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  return *greatest - *least;
}

void print_sweep_text(const Sweep& sweep) {
  TextTable table;
  std::vector<std::string> head{"parameter", "value", "completion", "accuracy", "F1"};
  if (sweep.ambiguous) head.insert(head.end(), {"accuracy w/", "F1 w/"});
  table.row(head);
  for (const SweepRow& row : sweep.rows) {
    std::vector<std::string> cells{row.parameter, fmt::format("{}", row.value), completion_text(row.completion)};
    for (const auto part : {&Scores::without, &Scores::with})
      if (part == &Scores::without || sweep.ambiguous)
        for (const auto metric : {&Confusion::accuracy, &Confusion::f1})
          cells.push_back(mean_text(over_files(row.files, part, metric)));
    table.row(cells);
  }
  table.print();
  print_line("\nSpread of accuracy, greatest less least, in points");
  TextTable spreads;
  spreads.row({"parameter", "completion kernel", "none"});
  for (const std::string& name : sweep.parameters()) {
    std::vector<std::string> cells{name};
    for (const Completion c : {Completion::kKernel, Completion::kNone}) {
      const auto spread = sweep.spread(name, c);
      cells.push_back(spread ? percent_text(*spread) : "-");
    }
    spreads.row(cells);
  }
  spreads.print();
  if (sweep.dropped > 0)
    print_line(fmt::format("{}, not finite or out of range, left out", counted(sweep.dropped, "point")));
  if (sweep.ambiguous) print_line("Without the ambiguous classes, but for the columns `w/`");
}

void print_sweep_json(const Sweep& sweep, const std::filesystem::path& folder) {
  Json json{{"preset", sweep.preset},
            {"files", sweep.files},
            {"dropped", sweep.dropped},
            {"csv", (folder / "sweep.csv").string()},
            {"plot", (folder / "sweep.svg").string()}};
  json["rows"] = Json::array();
  for (const SweepRow& row : sweep.rows) {
    Json object{{"parameter", row.parameter}, {"value", row.value}, {"completion", completion_text(row.completion)}};
    for (const ScorePart& part : kScoreParts)
      for (const PaperMetric& metric : kPaperMetrics) {
        const MeanDeviation m = over_files(row.files, part.value, metric.value);
        object[part.key][metric.key] = {{"mean", m.mean}, {"deviation", m.deviation}};
      }
    json["rows"].push_back(object);
  }
  for (const std::string& name : sweep.parameters())
    for (const Completion c : {Completion::kKernel, Completion::kNone})
      if (const auto spread = sweep.spread(name, c)) json["spread_of_accuracy"][name][completion_text(c)] = *spread;
  print_json(json);
}

void write_sweep_csv(const Sweep& sweep, const std::filesystem::path& csv) {
  std::string text = "parameter,value,completion,files";
  for (const ScorePart& part : kScoreParts)
    for (const PaperMetric& metric : kPaperMetrics)
      text += fmt::format(",{1}_{0},{1}_{0}_deviation", part.key, metric.key);
  text += '\n';
  for (const SweepRow& row : sweep.rows) {
    text += fmt::format("{},{},{},{}", row.parameter, row.value, completion_text(row.completion), row.files.size());
    for (const ScorePart& part : kScoreParts)
      for (const PaperMetric& metric : kPaperMetrics) {
        const MeanDeviation m = over_files(row.files, part.value, metric.value);
        text += fmt::format(",{:.6f},{:.6f}", m.mean, m.deviation);
      }
    text += '\n';
  }
  write_file(csv, text);
}

}  // namespace btms
