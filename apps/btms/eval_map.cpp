#include "apps/btms/eval_map.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cmath>

#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/model/surface.h"

namespace btms {
namespace {

constexpr double kBlock_m = 48;
// Where the first place lies, in spacings: nothing in common with a lattice of round numbers or its diagonals.
constexpr double kFirst_x = 0.37, kFirst_y = 0.61;

struct Named {
  const char* key;
  const char* title;
};
constexpr std::array<Named, kStrata> kStratumNames = {{{"open", "open"},
                                                       {"under_plants", "under plants"},
                                                       {"hollow", "hollow"},
                                                       {"behind_wall", "behind a wall"},
                                                       {"under_vehicle", "under a vehicle"},
                                                       {"under_building", "under a building"},
                                                       {"under_bridge", "under a bridge"}}};
constexpr std::array<Named, 5> kStateNames = {{{"unknown", "unknown"},
                                               {"observed", "observed"},
                                               {"predicted", "predicted"},
                                               {"obstacle", "obstacle"},
                                               {"filled", "filled"}}};

// The places of an axis: first + k * spacing, to the millimetre, as a map rounds them.
struct Axis {
  double origin_m, spacing_m, first;
  double at(std::size_t k) const {
    return origin_m + std::floor((static_cast<double>(k) + first) * spacing_m * 1000 + 0.5) / 1000;
  }
};

std::size_t places_on(double length_m, double spacing_m) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(length_m / spacing_m));
}

void sample_block(const TileSource& map, const Scene& scene, std::span<const ScenePlace> places,
                  std::vector<SurfaceSample>& samples) {
  std::vector<PlaceTruth> truths(places.size());
  scene.truth(places, truths);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const SurfacePoint s = surface_at(map, places[i].x_m, places[i].y_m);
    const PlaceTruth& truth = truths[i];
    samples.push_back(surface_sample(s.state, s.z_m, s.sd_m, truth.ground_z_m, static_cast<std::uint8_t>(truth.stratum),
                                     truth.at_step));
  }
}

bool regular(const SurfaceSample& s) { return !s.at_step; }
auto of_stratum(std::size_t k) {
  return [k](const SurfaceSample& s) { return !s.at_step && s.group == k; };
}
auto of_state(std::size_t k) {
  return [k](const SurfaceSample& s) { return !s.at_step && static_cast<std::size_t>(s.state) == k; };
}

std::vector<std::string> row_of(const std::string& name, const SurfaceScores& s) {
  std::vector<std::string> row{name, grouped(s.places)};
  const double filled = s.complete() - s.inferred();
  if (s.known == 0) {
    row.insert(row.end(), {"-", "-", "-", "-"});
  } else {
    for (const double v : {s.rmse_m, s.mae_m, s.bias_m, s.p95_m}) row.push_back(fmt::format("{:.3f}", v));
  }
  row.insert(row.end(),
             {percent_text(s.complete()), percent_text(filled), s.known == 0 ? "-" : percent_text(s.within)});
  return row;
}

Json scores_json(const SurfaceScores& s) {
  const auto number = [&](double v) { return s.known == 0 ? Json() : Json(tidy(v)); };
  return {{"places", s.places},
          {"known", s.known},
          {"filled", s.filled},
          {"complete", tidy(s.complete())},
          {"complete_without_filled", tidy(s.inferred())},
          {"rmse_m", number(s.rmse_m)},
          {"mae_m", number(s.mae_m)},
          {"bias_m", number(s.bias_m)},
          {"p95_m", number(s.p95_m)},
          {"within_95", number(s.within)}};
}

template <typename Holds>
Json states_json(std::span<const SurfaceSample> samples, Holds holds) {
  Json json;
  for (std::size_t k = 1; k < kStateNames.size(); ++k)
    json[kStateNames[k].key] = scores_json(score_surface(
        samples, [&](const SurfaceSample& s) { return holds(s) && static_cast<std::size_t>(s.state) == k; }));
  return json;
}

}  // namespace

std::vector<SurfaceSample> sample_map(const TileSource& map, const Scene& scene, double spacing_m,
                                      const Threads& threads, Progress& progress) {
  const Axis x{scene.origin_x_m(), spacing_m, kFirst_x}, y{scene.origin_y_m(), spacing_m, kFirst_y};
  const std::size_t columns = places_on(scene.width_m(), spacing_m), rows = places_on(scene.height_m(), spacing_m);
  if (static_cast<double>(columns) * static_cast<double>(rows) > 0x1p28)
    throw Error(ErrorCode::kUsage, "--spacing: more than 268 million places to compare; choose a larger one");
  const std::size_t edge = places_on(kBlock_m, spacing_m);
  const std::size_t across = (columns + edge - 1) / edge, up = (rows + edge - 1) / edge;
  progress.begin("compare", across * up, "blocks");
  std::vector<std::vector<SurfaceSample>> blocks(across * up);
  threads.for_each(blocks.size(), [&](std::size_t b, int) {
    throw_if_stopped();
    std::vector<ScenePlace> places;
    for (std::size_t j = b / across * edge; j < std::min(rows, (b / across + 1) * edge); ++j)
      for (std::size_t i = b % across * edge; i < std::min(columns, (b % across + 1) * edge); ++i)
        places.push_back({x.at(i), y.at(j)});
    sample_block(map, scene, places, blocks[b]);
    progress.advance(1);
  });
  std::vector<SurfaceSample> samples;
  samples.reserve(columns * rows);
  for (const auto& block : blocks) samples.insert(samples.end(), block.begin(), block.end());
  return samples;
}

void warn_of_another_scene(std::span<const SurfaceSample> samples) {
  const SurfaceScores s = score_surface(samples, regular);
  const bool elsewhere = s.inferred()<0.95, wrong = s.places> 0 && s.within < 0.5;
  if (elsewhere || wrong)
    spdlog::warn("{}: are --scene, --points, --density, --seed and --origin those of the `synth` call?",
                 elsewhere ? "the map says little of a part of the scene" : "the map is not like the scene at all");
}

void print_map_eval_text(const MapEvalHeading& heading, std::span<const SurfaceSample> samples) {
  print_line(fmt::format("{} against the terrain of {} (seed {}, {} points), every {} m; metres and percent",
                         heading.map, heading.scene.name, heading.scene.seed, grouped(heading.scene.points),
                         heading.spacing_m));
  TextTable table;
  table.row({"places", "number", "RMSE", "MAE", "bias", "p95", "complete", "filled", "95 %"});
  table.row(row_of("all", score_surface(samples, regular)));
  const auto rows = [&](const auto& names, std::size_t first, const auto& of) {
    for (std::size_t k = first; k < names.size(); ++k)
      if (const SurfaceScores s = score_surface(samples, of(k)); s.places > 0) table.row(row_of(names[k].title, s));
  };
  rows(kStratumNames, 0, of_stratum);
  table.row(row_of("at steps", score_surface(samples, [](const SurfaceSample& s) { return s.at_step; })));
  rows(kStateNames, 1, of_state);
  table.print();
}

void print_map_eval_json(const MapEvalHeading& heading, std::span<const SurfaceSample> samples) {
  Json json{{"map", heading.map},
            {"scene", heading.scene.name},
            {"seed", heading.scene.seed},
            {"points", heading.scene.points},
            {"spacing_m", heading.spacing_m}};
  json["all"] = scores_json(score_surface(samples, regular));
  json["all"]["states"] = states_json(samples, regular);
  for (std::size_t k = 0; k < kStrata; ++k) {
    Json& stratum = json["strata"][kStratumNames[k].key];
    stratum = scores_json(score_surface(samples, of_stratum(k)));
    stratum["states"] = states_json(samples, of_stratum(k));
  }
  json["at_steps"] = scores_json(score_surface(samples, [](const SurfaceSample& s) { return s.at_step; }));
  print_json(json);
}

}  // namespace btms
