#include "engine/scenes/scene.h"

#include "engine/error.h"
#include "engine/scenes/airborne.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

struct Row {
  const char* name;
  std::unique_ptr<World> (*make)(std::uint64_t seed);
};

constexpr Row kTable[] = {
    {"city", make_city},   {"hills", make_hills},       {"quarry", make_quarry},
    {"bumpy", make_bumpy}, {"indoor", make_indoor},     {"forest", make_forest},
    {"halls", make_halls}, {"hillside", make_hillside}, {"overpass", make_overpass},
};

}  // namespace

std::vector<std::string> Scene::names() {
  std::vector<std::string> all;
  for (const Row& row : kTable) all.emplace_back(row.name);
  return all;
}

PlaceTruth Scene::truth(double x_m, double y_m) const {
  const ScenePlace place{x_m, y_m};
  PlaceTruth known;
  truth({&place, 1}, {&known, 1});
  return known;
}

std::unique_ptr<Scene> Scene::create(const SceneOptions& options) {
  return std::make_unique<AirborneScene>(options, make_world(options.name, options.seed));
}

std::unique_ptr<World> make_world(const std::string& name, std::uint64_t seed) {
  for (const Row& row : kTable)
    if (name == row.name) return row.make(seed);
  std::string known;
  for (const Row& row : kTable) known += (known.empty() ? "" : ", ") + std::string(row.name);
  throw Error(ErrorCode::kUsage, "unknown scene '" + name + "'; there are " + known);
}

}  // namespace btms
