#include "apps/btms/scene_options.h"

#include "apps/btms/coordinates.h"
#include "apps/btms/number_range.h"

namespace btms {
namespace {

std::string scene_list() {
  std::string text;
  for (const std::string& name : Scene::names()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

SceneOptions SceneArguments::options() const {
  SceneOptions placed = scene;
  const Place corner = parse_place(origin, "--origin");
  placed.origin_x_m = corner.x_m;
  placed.origin_y_m = corner.y_m;
  return placed;
}

std::unique_ptr<Scene> SceneArguments::create() const { return Scene::create(options()); }

CLI::Option* add_scene_options(CLI::App& app, SceneArguments& arguments, const char* group) {
  CLI::Option* name =
      app.add_option("--scene", arguments.scene.name, "One of " + scene_list())->type_name("NAME")->group(group);
  app.add_option("--density", arguments.scene.density_per_m2,
                 "Points per square metre (default: the scene's, 10; forest 25)")
      ->check(number_range(0.01, 10000.0))
      ->default_str("")
      ->type_name("D")
      ->group(group);
  app.add_option("--seed", arguments.scene.seed, "Another seed, another world")->type_name("S")->group(group);
  app.add_option("--origin", arguments.origin, "South-west corner in metres")->type_name("X,Y")->group(group);
  return name;
}

}  // namespace btms
