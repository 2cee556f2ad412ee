// The point files a subcommand was given.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/btms/report.h"
#include "io/points/point_file.h"

namespace btms {

using PointFiles = std::vector<std::unique_ptr<PointFile>>;

// Opens every file, so that a bad one is refused before any work or output. Raises the limit of open files when needed.
PointFiles open_all(std::span<const std::filesystem::path> paths);

// What was odd about the files, to the log.
void log_warnings(const PointFiles& files);
Json input_json(const PointFile& file);

std::uint64_t total_points(const PointFiles& files);

// Makes the folder of an output per input. Throws Error(kUsage) when two inputs would have the same output, or an
// output would be an input.
void prepare_output_folder(const PointFiles& inputs, const std::filesystem::path& folder);

// The reference system of a --crs option, normalised; empty stays empty. Throws Error(kUsage) when PROJ doesn't know
// it, or its unit is not the metre.
std::string metric_crs(const std::string& text);

// The one reference system of the files, normalised; empty when none names one. `wanted`, when not empty, wins.
// Throws Error(kBadInput) naming two files that differ.
std::string agreed_crs(const PointFiles& files, const std::string& wanted);

}  // namespace btms
