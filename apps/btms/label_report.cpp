#include "apps/btms/label_report.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "apps/btms/report.h"

namespace btms {
namespace {

constexpr std::size_t kFilesShown = 20;  // the table would scroll away; --json lists them all

Json counts_json(const LabelCounts& c, std::uint64_t points) {
  return {{"points", points}, {"terrain", c.terrain}, {"obstacle", c.obstacle},
          {"below", c.below}, {"dropped", c.dropped}, {"outside", c.outside}};
}

std::vector<std::string> cells(const std::string& name, const LabelCounts& c, std::uint64_t points) {
  return {name,
          grouped(points),
          grouped(c.terrain),
          grouped(c.obstacle),
          grouped(c.below),
          grouped(c.dropped),
          grouped(c.outside)};
}

}  // namespace

void LabelReport::add(const PointFile& input, const std::filesystem::path& output, const LabelCounts& counts) {
  files.push_back({input.path(), output, input.size(), counts});
}

void LabelReport::print(bool as_json) const {
  LabelCounts total;
  std::uint64_t points = 0;
  for (const File& file : files) {
    points += file.points;
    total.terrain += file.counts.terrain;
    total.obstacle += file.counts.obstacle;
    total.below += file.counts.below;
    total.dropped += file.counts.dropped;
    total.outside += file.counts.outside;
  }
  const double rate = seconds > 0 ? static_cast<double>(points) / seconds : 0;
  if (as_json) {
    Json json;
    json["files"] = Json::array();
    for (const File& file : files) {
      Json entry{{"input", file.input.string()}, {"output", file.output.string()}};
      entry.update(counts_json(file.counts, file.points));
      json["files"].push_back(std::move(entry));
    }
    json["total"] = counts_json(total, points);
    json["seconds"] = tidy(seconds);
    json["points_per_second"] = std::round(rate);
    if (mean_scan_seconds >= 0) json["mean_scan_seconds"] = tidy(mean_scan_seconds);
    json["peak_rss_bytes"] = peak_rss_bytes();
    json["warnings"] = warnings;
    return print_json(json);
  }
  TextTable table;
  table.row({"file", "points", "terrain", "obstacle", "below", "dropped", "no surface there"});
  for (std::size_t i = 0; i < std::min(files.size(), kFilesShown); ++i)
    table.row(cells(files[i].output.string(), files[i].counts, files[i].points));
  if (files.size() > kFilesShown) table.row({fmt::format("... {} more", files.size() - kFilesShown)});
  if (files.size() > 1) table.row(cells("in all", total, points));
  table.print();
  if (mean_scan_seconds >= 0)
    print_line(fmt::format("{:.2f} ms per scan without file access", 1000 * mean_scan_seconds));
  print_line(fmt::format("{}, {} points/s, peak memory {}", seconds_text(seconds), rounded(rate),
                         bytes_text(peak_rss_bytes())));
}

}  // namespace btms
