// A row of the macro bench: one method, one size, one number of threads, one job.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/macro/child.h"
#include "engine/metrics/metrics.h"

namespace btms::bench {

struct Row {
  std::string method, job;  // "city", "fixed r=2", "pcl pmf" ...; "build", "label" or "both"
  std::uint64_t points = 0;
  int threads = 1;
  int repetitions = 0;
  Cost cost;                // median of the repetitions, column by column
  double least_wall_s = 0;  // of the repetitions
  double copy_s = 0;        // `cp` of the same input files, median
  double points_per_node = 0;
  double filter_s = 0;     // peers: the filter alone, without reading and writing
  double thread_gain = 0;  // wall time of one thread over this; 0 where one thread was not measured
  Confusion labels;        // against the scene's truth; nothing for a build

  std::string key() const;  // what makes it the same row in another run
};

// Medians of what was measured, column by column; `costs` is not empty.
Cost median(const std::vector<Cost>& costs);
double median(std::vector<double> values);

nlohmann::ordered_json to_json(const Row& row);
Row row_from_json(const nlohmann::ordered_json& json);

// Markdown, on stdout.
void print_heading();
void print_row(const Row& row);
// New over old, for rows that are in both.
void print_comparison(const std::vector<Row>& rows, const std::vector<Row>& old);

}  // namespace btms::bench
