// The part of `btms synth` that drives through a scene.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/btms/common_options.h"
#include "apps/btms/scene_options.h"
#include "engine/scenes/drive.h"

namespace btms {

struct DriveArguments {
  bool drive = false;
  DriveOptions options;
  std::vector<double> field_of_view_deg{2, -24.8};
};

// Adds --drive and what needs it; returns --drive.
CLI::Option* add_drive_options(CLI::App& app, DriveArguments& arguments);

// Writes a drive in SemanticKITTI's layout and says what it wrote. Throws Error(kUsage) where something of the kind is
// there already and `force` is not given.
int run_drive(const SceneArguments& scene, const DriveArguments& drive, const std::string& folder, bool force,
              const CommonOptions& common);

}  // namespace btms
