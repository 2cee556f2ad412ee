// How a build goes on from what is in its folder: afresh, from where one was interrupted, or from a finished map.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/points/point_file.h"
#include "io/store/map_store.h"

namespace btms {

struct ContinuationRequest {
  bool resume = false, updatable = false, update = false;
  std::vector<std::string> removed;  // names of inputs
  bool replace = false;
};

struct Continuation {
  bool finished = false;  // there is nothing left to do
  bool resume = false;    // an interrupted build of the same is there
  bool follow = false;    // of the map that is there, all is known: only what has changed is worked out
  std::uint64_t revision = 1;
  std::uint64_t since = 0;               // the revision from which on records are kept; 0: they aren't
  std::vector<std::string> round_files;  // that hold what is known
};

// The inputs of an update: those of the map, less the removed and replaced ones, and `added`. Throws Error(kUsage)
// naming an input that is gone, or a name to remove that the map doesn't have.
InputList updated_inputs(const MapInfo& map, const std::filesystem::path& folder, const ContinuationRequest& request,
                         const InputList& added);

// Where an input of a map is; empty where the map doesn't know.
std::filesystem::path input_path(const InputRecord& input, const std::filesystem::path& folder);

// A record of an input for the manifest; its path is told from the map's folder.
InputRecord input_record(const PointFile& file, const std::filesystem::path& folder);

// build_identity() of what the finished map says of itself: whenever its inputs were written.
std::string stored_identity(MapInfo info);

// `wanted` is what is to be built. Throws Error(kUsage) when an interrupted or finished build that is to be taken up is
// one of something else.
Continuation continuation(const std::filesystem::path& folder, const MapInfo& wanted,
                          const ContinuationRequest& request);

}  // namespace btms
