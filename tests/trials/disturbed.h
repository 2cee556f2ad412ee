// The program under preload.cpp, and what must hold of the folders it leaves.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "engine/model/digest.h"
#include "io/files/atomic_file.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/map_store.h"
#include "io/store/round_files.h"
#include "tests/cli/program.h"

namespace btms::test {

using Environment = std::vector<std::pair<std::string, std::string>>;

// Variables of the process while it lives: what is started meanwhile inherits them.
class Variables {
 public:
  explicit Variables(Environment variables) : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Variables() {
    for (const auto& [name, value] : variables_) unsetenv(name.c_str());
  }
  Variables(const Variables&) = delete;
  Variables& operator=(const Variables&) = delete;

 private:
  const Environment variables_;
};

struct Disturbed {
  Outcome outcome;
  bool hung = false;
  std::uint64_t calls = 0, failed = 0, syncs_failed = 0;  // that the error could befall, that it befell
};

// Runs the program under preload.cpp with `variables`; stdout goes to `out` where one is named.
inline Disturbed run_disturbed(const std::vector<std::string>& arguments, Environment variables,
                               const std::string& out = {}) {
  constexpr auto kLongest = std::chrono::seconds(60);
  const TempFolder folder;
  const std::string counts = folder / "counts";
  write_text(counts, std::string(24, '\0'));
  variables.emplace_back("BTMS_FAULTS_STATE", counts);
  variables.emplace_back("LD_PRELOAD", BTMS_FAULTS_LIBRARY);
  std::optional<Running> program;
  {
    const Variables set(std::move(variables));
    program.emplace(arguments, "", out);
  }
  Disturbed run;
  const auto begun = std::chrono::steady_clock::now();
  while (!program->has_ended()) {
    if (!run.hung && std::chrono::steady_clock::now() - begun > kLongest) {
      run.hung = true;
      program->send(SIGKILL);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  run.outcome = program->wait();
  const std::string numbers = read_text(counts);
  std::memcpy(&run.calls, numbers.data(), 8);
  std::memcpy(&run.failed, numbers.data() + 8, 8);
  std::memcpy(&run.syncs_failed, numbers.data() + 16, 8);
  return run;
}

// Everything in a folder and below: path in it -> content ("" for folders, which end in /).
using Files = std::map<std::string, std::string>;
inline Files files_in(const fs::path& folder) {
  Files files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (entry.is_directory())
      files[name + "/"];
    else
      files[name] = read_text(entry.path());
  }
  return files;
}

// The first name that only a file still being written has; "" when there is none.
inline std::string temporary_in(const fs::path& folder) {
  if (!fs::exists(folder)) return {};
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().filename().string().starts_with(".btms-")) return entry.path().string();
  return {};
}

// Digest of a map all of whose tiles have been read and checked, "" where there is no map; throws what the reader says
// when there is half of one, and Error(kVerification) when the tiles don't make up its digest.
inline std::string map_digest(const fs::path& folder) {
  if (!fs::exists(folder / kManifest)) return {};
  const auto reader = MapReader::open(folder);
  Digest sum;
  for (const TileId id : reader->tiles()) sum += digest(*reader->load(id));
  if (sum != reader->info().digest)
    throw Error(ErrorCode::kVerification, "its tiles make another digest than it says", folder.string());
  return sum.hex();
}

// Shards, journals and records are left for a build that goes on.
inline bool is_for_a_resume(const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  return shard_revision(name) || is_journal_name(name) || fs::path(path).parent_path().filename() == kRoundFolder;
}

// files_in(), but maps as what they hold: their parts without content, and `digest`, of all tiles. Throws what
// map_digest() throws.
inline Files results_in(const fs::path& folder) {
  Files files = files_in(folder), digests;
  for (auto& [name, content] : files) {
    const fs::path path(name);
    if (path.filename() == kManifest)
      digests[(path.parent_path() / "digest").string()] = map_digest(folder / path.parent_path());
    if (path.filename() == kManifest || path.extension() == ".nc") content.clear();
  }
  files.merge(digests);
  return files;
}

// What is wrong in a folder after a command failed there; "" when nothing is. Every file must be as it was or as it was
// to be (shards may be left for a build that goes on), none may be gone, and a map must be whole.
inline std::string half_done(const fs::path& folder, const Files& before, const Files& wanted) {
  Files found;
  try {
    found = results_in(folder);
  } catch (const Error& e) {
    return std::string("the map is damaged: ") + e.what();
  }
  const auto is = [](const Files& files, const auto& entry) {
    const auto it = files.find(entry.first);
    return it != files.end() && it->second == entry.second;
  };
  for (const auto& entry : found)
    if (!is(before, entry) && !is(wanted, entry) && !is_for_a_resume(entry.first)) return "half done: " + entry.first;
  for (const auto& [name, content] : before)
    if (!found.contains(name) && wanted.contains(name)) return "gone: " + name;
  return {};
}

// What is wrong with how a command ended that worked in `folder`; "" when nothing is. `remedy`: what its message must
// contain.
inline std::string wrong_end(const Disturbed& run, const fs::path& folder, const Files& before, const Files& wanted,
                             const std::string& remedy) {
  if (run.hung) return "hung";
  if (run.outcome.status != 0 && run.outcome.status != 1) return "neither success nor failure";
  if (const std::string name = temporary_in(folder); !name.empty()) return "left " + name;
  if (run.outcome.status == 0) {
    if (run.syncs_failed > 0) return "success, although an fsync failed";
    const std::string wrong = half_done(folder, wanted, wanted);
    return wrong.empty() ? wrong : "success, but " + wrong;
  }
  if (run.outcome.err.find(remedy) == std::string::npos) return "the message names no remedy";
  return half_done(folder, before, wanted);
}

}  // namespace btms::test
