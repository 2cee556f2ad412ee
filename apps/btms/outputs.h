// Where results go, checked before the work: hours must not end at an output that could never be written, and nothing
// that is there already is replaced unasked.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <span>
#include <string>

#include "apps/btms/inputs.h"

namespace btms {

void add_force_option(CLI::App& app, bool& force);

// Throws Error(kUsage) naming the first output that exists, unless `force`.
void refuse_existing(std::span<const std::filesystem::path> outputs, bool force);

// Makes the folder of a label file per input. Throws Error(kUsage) when two inputs would have the same output, an
// output would be an input, or exists and `force` is not given; Error(kFailed) when the disk lacks the room.
void prepare_label_folder(const PointFiles& inputs, const std::filesystem::path& folder, bool force);

// Throws Error(kUsage) for a picture that is not NAME.png in a folder that exists, is an input, or lies inside a map;
// `map` is one that is still to be made, or empty.
void check_picture(const std::filesystem::path& picture, const std::filesystem::path& map,
                   std::span<const std::filesystem::path> inputs);

}  // namespace btms
