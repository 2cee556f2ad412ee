// The map a subcommand was given.
#pragma once

#include <memory>
#include <string>

#include "io/store/map_store.h"

namespace btms {

// Throws Error(kUsage) when nothing is there, Error(kBadInput) when it is no map, and what MapReader::open() throws.
std::unique_ptr<MapReader> open_map(const std::string& path);

}  // namespace btms
