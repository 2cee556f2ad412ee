// The point files a subcommand was given.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/btms/report.h"
#include "io/points/point_file.h"

namespace btms {

using PointFiles = std::vector<std::unique_ptr<PointFile>>;

// Opens every file, so that a bad one is refused before any work or output.
PointFiles open_all(std::span<const std::filesystem::path> paths, const PointFileOptions& options = {});

void add_columns_option(CLI::App& app, PointFileOptions& options);

// What was odd about the list and the files, to the log.
void log_warnings(const InputList& list, const PointFiles& files);
void log_warnings(const InputList& list);
void log_warnings(const PointFile& file);
Json input_json(const PointFile& file);

std::uint64_t total_points(const PointFiles& files);

}  // namespace btms
