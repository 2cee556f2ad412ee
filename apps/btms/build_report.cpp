#include "apps/btms/build_report.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace btms {
namespace {

double points_per_second(const BuildReport& report) {
  return report.seconds > 0 ? static_cast<double>(report.summary.points) / report.seconds : 0;
}

Json report_json(const BuildReport& report) {
  const BuildSummary& s = report.summary;
  Json phases = Json::array();
  for (const PhaseTime& phase : s.phases)
    phases.push_back({{"phase", phase.phase},
                      {"seconds", tidy(phase.seconds)},
                      {"sent_bytes", phase.traffic.sent_bytes},
                      {"shared_bytes", phase.traffic.shared_bytes}});
  Json json;
  json["map"] = report.map;
  if (!report.picture.empty()) json["picture"] = report.picture;
  json["digest"] = s.digest.hex();
  json["points"] = s.points;
  json["dropped"] = {{"not_finite", s.not_finite}, {"out_of_range", s.out_of_range}, {"strays", s.strays}};
  json["outside_box"] = s.outside_box;
  json["extent_m"] = s.extent_m;
  json["tiles"] = s.tiles;
  if (report.updated)
    json["update"] = {{"tiles_worked_on", s.tiles_recomputed},
                      {"tiles_in_reach", s.tiles_in_reach},
                      {"tiles_renewed", s.tiles_renewed}};
  json["nodes"] = {{"total", s.nodes},       {"observed", s.observed}, {"predicted", s.predicted},
                   {"obstacle", s.obstacle}, {"filled", s.filled},     {"unknown", s.unknown}};
  json["components"] = {{"found", s.components}, {"kept", s.components_kept}};
  json["seconds"] = tidy(report.seconds);
  json["phases"] = phases;
  json["points_per_second"] = std::round(points_per_second(report));
  json["peak_rss_bytes"] = peak_rss_bytes();
  json["spilled_bytes"] = s.spilled_bytes;
  json["executor"] = report.executor;
  json["preset"] = report.choice.preset;
  json["parameters"] = parameters_json(report.choice.parameters);
  json["inputs"] = report.inputs;
  json["trajectory"] = trajectory_json(report.trajectory);
  json["warnings"] = report.warnings;
  return json;
}

}  // namespace

Json trajectory_json(const std::optional<TrajectoryRecord>& t) {
  return t ? Json{{"name", t->name}, {"poses", t->poses}, {"bytes", t->bytes}} : Json();
}

std::string trajectory_text(const TrajectoryRecord& t) {
  return fmt::format("{}, {}", t.name, counted(t.poses, "pose"));
}

void print_build_report(const BuildReport& report, bool as_json) {
  if (as_json) return print_json(report_json(report));
  const BuildSummary& s = report.summary;
  TextTable table(TextTable::Align::kLeft);
  table.row({"points", fmt::format("{} from {}", grouped(s.points), counted(report.inputs.size(), "file"))});
  if (report.trajectory) table.row({"trajectory", trajectory_text(*report.trajectory)});
  table.row({"dropped", fmt::format("{} not finite, {} out of range, {} astray", grouped(s.not_finite),
                                    grouped(s.out_of_range), grouped(s.strays))});
  table.row({"extent", fmt::format("{:.0f} x {:.0f} m", s.extent_m[2] - s.extent_m[0], s.extent_m[3] - s.extent_m[1])});
  table.row({"tiles", grouped(s.tiles)});
  if (report.updated)
    table.row(
        {"update", fmt::format("{} worked on, {} in reach of the changes, {} renewed", grouped(s.tiles_recomputed),
                               grouped(s.tiles_in_reach), grouped(s.tiles_renewed))});
  table.row({"nodes", fmt::format("{}: {} observed, {} predicted, {} obstacle, {} filled, {} unknown", grouped(s.nodes),
                                  grouped(s.observed), grouped(s.predicted), grouped(s.obstacle), grouped(s.filled),
                                  grouped(s.unknown))});
  table.row({"components", fmt::format("{}, {} kept", grouped(s.components), grouped(s.components_kept))});
  table.row({"digest", s.digest.hex()});
  for (const PhaseTime& phase : s.phases) table.row({phase.phase, seconds_text(phase.seconds)});
  table.row(
      {"in all", fmt::format("{}, {} points/s", seconds_text(report.seconds), rounded(points_per_second(report)))});
  table.row({"peak memory", bytes_text(peak_rss_bytes())});
  if (s.spilled_bytes > 0) table.row({"spilled", bytes_text(s.spilled_bytes)});
  table.row({"map", report.map});
  if (!report.picture.empty()) table.row({"picture", report.picture});
  table.print();
}

}  // namespace btms
