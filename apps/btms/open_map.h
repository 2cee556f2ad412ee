// The map a subcommand was given.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "io/store/map_store.h"

namespace btms {

// --untrusted
void add_untrusted_option(CLI::App& app, bool& untrusted);

// Throws Error(kUsage) when nothing is there, Error(kBadInput) when it is no map, and what MapReader::open() throws.
std::unique_ptr<MapReader> open_map(const std::string& path, bool untrusted = false);
// The checks of the folder alone.
void check_is_map(const std::string& path);

}  // namespace btms
