// The options that name a synthetic scene, the same for `synth` that makes it and `eval` that scores against it.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "engine/scenes/scene.h"

namespace btms {

struct SceneArguments {
  SceneOptions scene;
  std::string origin = "0,0";

  // With the origin. Throws Error(kUsage) for a bad one.
  SceneOptions options() const;
  // Throws Error(kUsage) for a bad origin and as Scene::create() does.
  std::unique_ptr<Scene> create() const;
};

// Adds --scene, --density, --seed and --origin; returns --scene. Not --points, which `eval` has for files too.
CLI::Option* add_scene_options(CLI::App& app, SceneArguments& arguments, const char* group);

}  // namespace btms
