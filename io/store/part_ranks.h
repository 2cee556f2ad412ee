// Ranks that need not run at the same time: the parts of a job array. What they tell each other are files in a folder
// that all of them see, so a part that finds something missing can end, and when it is started again it gets back to
// where it was: it does the same work, and is told the same. docs/job_arrays.md
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/tiling/executor.h"

namespace btms {

inline constexpr int kMostParts = 4096;

struct PartOptions {
  int part = 0, parts = 1;  // counted from 0
  std::string identity;     // of what is built: the same for all parts
  double wait_s = 0;        // how long to wait for another part before giving up
  std::function<bool()> stop_requested = [] { return false; };
};

// Where the parts of the map `map` talk: beside it, MAP.parts.
std::filesystem::path parts_folder(const std::filesystem::path& map);

// exchange() and share() throw Error(kUnfinished) when another part hasn't come as far yet, naming it;
// Error(kCancelled) when it is to stop. Throws Error(kUsage) when the folder belongs to other parts (another number of
// them, other inputs or parameters), Error(kFailed) when this part is at work already.
std::unique_ptr<Ranks> part_ranks(const std::filesystem::path& folder, const PartOptions& options);

struct PartsState {
  int parts = 0;
  std::string identity;
  std::vector<std::string> reached;  // by part: the topic of its last message; empty: has not begun
};
// Throws Error(kUsage) when there are none.
PartsState read_parts(const std::filesystem::path& folder);

// All that parts have told each other.
void remove_parts(const std::filesystem::path& folder);

}  // namespace btms
