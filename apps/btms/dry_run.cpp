#include "apps/btms/dry_run.h"

#include <spdlog/fmt/fmt.h>

#include "apps/btms/report.h"
#include "io/store/shard_assembly.h"
#include "io/store/shard_file.h"

namespace btms {
namespace {

// Encodes tiles as a map stores them, and keeps only their size.
class Weigher final : public TileSink {
 public:
  Digest put(TileId id, TerrainTile&& tile) override {
    std::vector<PlacedTile> shard;
    shard.emplace_back(id, std::move(tile));
    bytes_ += encode_shard(assemble(std::move(shard)), {}).file.size();
    return {};  // nobody asks what a trial has made
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::uint64_t bytes_ = 0;  // a trial runs in one thread
};

}  // namespace

DryRun dry_run(const PointFiles& files, const BuildOptions& options, int threads) {
  std::vector<const PointSource*> sources;
  for (const auto& file : files) sources.push_back(file.get());
  DryRun run;
  run.threads = threads;
  run.survey = survey_points(sources, options);
  Weigher weigher;
  const Trial trial = try_build(sources, run.survey, options, [&](const MapLayout&) -> TileSink& { return weigher; });
  run.forecast = forecast_build(run.survey, trial, weigher.bytes(), options, threads);
  return run;
}

void print_dry_run(const DryRun& run, bool as_json) {
  const PointSurvey& s = run.survey;
  const Forecast& f = run.forecast;
  if (as_json)
    return print_json({{"dry_run", true},
                       {"points", s.points},
                       {"area_m2", std::round(s.area_m2)},
                       {"density_per_m2", tidy(s.density_per_m2())},
                       {"tiles", s.tiles},
                       {"nodes", s.nodes},
                       {"points_per_node", tidy(s.points_per_node())},
                       {"threads", run.threads},
                       {"seconds", tidy(f.seconds)},
                       {"memory_bytes", f.memory_bytes},
                       {"map_bytes", f.map_bytes},
                       {"spill_bytes", f.spill_bytes}});
  TextTable table(TextTable::Align::kLeft);
  table.row({"points",
             fmt::format("{} on {:.3g} km2, {:.1f} per m2", grouped(s.points), s.area_m2 / 1e6, s.density_per_m2())});
  table.row({"tiles", grouped(s.tiles)});
  table.row({"nodes", fmt::format("{}, {:.1f} points in a node with points", grouped(s.nodes), s.points_per_node())});
  table.row({"time", fmt::format("{} with {}", seconds_text(f.seconds), counted(run.threads, "thread"))});
  table.row({"memory", bytes_text(f.memory_bytes)});
  table.row({"map", bytes_text(f.map_bytes)});
  table.row({"spill", bytes_text(f.spill_bytes)});
  table.print();
  print_line("Forecast from a sample of the points; nothing was written.");
}

}  // namespace btms
