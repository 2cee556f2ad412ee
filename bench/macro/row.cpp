#include "bench/macro/row.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace btms::bench {
namespace {

template <class Field>
auto median_of(const std::vector<Cost>& costs, Field field) {
  std::vector<std::remove_cvref_t<decltype(costs[0].*field)>> values;
  for (const Cost& cost : costs) values.push_back(cost.*field);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

std::string size_text(std::uint64_t points) {
  // The scene makes a few more or less than it was asked for.
  double millions = static_cast<double>(points) / 1e6;
  millions = millions < 10 ? std::round(millions * 10) / 10 : std::round(millions);
  return millions >= 1000 ? fmt::format("{:g} G", millions / 1000) : fmt::format("{:g} M", millions);
}

std::string or_dash(double value, const char* format) {
  return value > 0 ? fmt::format(fmt::runtime(format), value) : "-";
}

double megabytes(std::uint64_t bytes) { return static_cast<double>(bytes) / 1e6; }

}  // namespace

void print_row(const Row& r) {
  const auto points = static_cast<double>(r.points);
  const Cost& c = r.cost;
  const std::string errors = r.labels.total() == 0 ? "- | - | -"
                                                   : fmt::format("{:.2f} | {:.2f} | {:.2f}", 100 * r.labels.type1(),
                                                                 100 * r.labels.type2(), 100 * r.labels.total_error());
  fmt::print(
      "| {} | {} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.1f} | {} | {} | {:.0f} | {:.0f} | {:.0f} | {} | {} | {} |\n",
      size_text(r.points), r.method, r.threads, r.job, points / c.wall_s / 1e6, 1e9 * c.wall_s / points,
      1e9 * c.user_s / points, 1e9 * c.system_s / points, or_dash(1e9 * r.filter_s / points, "{:.1f}"),
      or_dash(r.points_per_node, "{:.1f}"), megabytes(c.peak_rss_bytes), megabytes(c.read_bytes),
      megabytes(c.written_bytes), or_dash(r.copy_s > 0 ? c.wall_s / r.copy_s : 0, "{:.1f}"),
      or_dash(r.thread_gain, "{:.2f}"), errors);
  std::fflush(stdout);
}

std::string Row::key() const { return fmt::format("{}, {} points, {} threads, {}", method, points, threads, job); }

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

Cost median(const std::vector<Cost>& costs) {
  return {median_of(costs, &Cost::wall_s),     median_of(costs, &Cost::user_s),
          median_of(costs, &Cost::system_s),   median_of(costs, &Cost::peak_rss_bytes),
          median_of(costs, &Cost::read_bytes), median_of(costs, &Cost::written_bytes)};
}

nlohmann::ordered_json to_json(const Row& r) {
  return {{"method", r.method},
          {"points", r.points},
          {"threads", r.threads},
          {"job", r.job},
          {"repetitions", r.repetitions},
          {"wall_s", r.cost.wall_s},
          {"least_wall_s", r.least_wall_s},
          {"user_s", r.cost.user_s},
          {"system_s", r.cost.system_s},
          {"peak_rss_bytes", r.cost.peak_rss_bytes},
          {"read_bytes", r.cost.read_bytes},
          {"written_bytes", r.cost.written_bytes},
          {"copy_s", r.copy_s},
          {"points_per_node", r.points_per_node},
          {"filter_s", r.filter_s},
          {"thread_gain", r.thread_gain},
          {"labels",
           {{"true_positive", r.labels.true_positive},
            {"false_positive", r.labels.false_positive},
            {"false_negative", r.labels.false_negative},
            {"true_negative", r.labels.true_negative}}}};
}

Row row_from_json(const nlohmann::ordered_json& j) {
  Row r;
  r.method = j.at("method");
  r.points = j.at("points");
  r.threads = j.at("threads");
  r.job = j.at("job");
  r.cost.wall_s = j.at("wall_s");
  r.cost.user_s = j.at("user_s");
  r.cost.peak_rss_bytes = j.at("peak_rss_bytes");
  r.copy_s = j.at("copy_s");
  return r;
}

void print_heading() {
  fmt::print(
      "| points | method | threads | job | M points/s | ns/point | user ns | system ns | filter ns | points/node | "
      "peak "
      "MB | read MB | written MB | of cp | 2 threads | type I % | type II % | total % |\n"
      "|--:|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
}

void print_comparison(const std::vector<Row>& rows, const std::vector<Row>& old) {
  fmt::print(
      "\nNew over old:\n\n| points | method | threads | job | wall | user CPU | peak memory | of cp |\n"
      "|--:|---|--:|---|--:|--:|--:|--:|\n");
  for (const Row& row : rows) {
    const auto before = std::find_if(old.begin(), old.end(), [&](const Row& o) { return o.key() == row.key(); });
    if (before == old.end()) continue;
    const auto ratio = [](double now, double then) { return then > 0 ? now / then : 0; };
    fmt::print(
        "| {} | {} | {} | {} | {} | {} | {} | {} |\n", size_text(row.points), row.method, row.threads, row.job,
        or_dash(ratio(row.cost.wall_s, before->cost.wall_s), "{:.2f}"),
        or_dash(ratio(row.cost.user_s, before->cost.user_s), "{:.2f}"),
        or_dash(ratio(megabytes(row.cost.peak_rss_bytes), megabytes(before->cost.peak_rss_bytes)), "{:.2f}"),
        or_dash(ratio(ratio(row.cost.wall_s, row.copy_s), ratio(before->cost.wall_s, before->copy_s)), "{:.2f}"));
  }
}

}  // namespace btms::bench
