// The paper's table: a block of rows a kind of data, metrics with mean and deviation over the clouds.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/metrics/metrics.h"

namespace btms::bench {

struct PaperRow {
  std::string method;
  std::vector<Scores> clouds;
  std::vector<double> seconds;  // CPU time of one thread, a cloud each
};
struct PaperBlock {
  std::string title;  // "single scans"
  std::vector<PaperRow> rows;
};

// Markdown, on stdout.
void print_block(const PaperBlock& block);
nlohmann::ordered_json to_json(const PaperBlock& block);

}  // namespace btms::bench
