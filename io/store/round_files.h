// The records of a build's rounds (engine/tiling/round_memory.h) as files in the map's folder `rounds`: one a number,
// revision and rank, immutable, blocks of compressed records with an index. docs/store_format.md
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>

#include "engine/tiling/round_memory.h"
#include "io/files/atomic_file.h"

namespace btms {

inline constexpr char kRoundFolder[] = "rounds";

struct RoundFilesOptions {
  std::uint64_t revision = 1;  // that is being built
  int rank = 0, ranks = 1;
  bool follow = false;  // the published map, whose records are those of earlier revisions
  bool resume = false;  // take up an interrupted build of this revision
  bool keep_all = false;
  std::uint64_t since = 1;              // where it follows: the revision from which on records hold
  std::vector<std::string> files = {};  // where it follows: those that have to be there
  double checkpoint_every_s = 20;
};

// Thread-safe. Records of files that are damaged count as missing.
class RoundFiles final : public RoundMemory {
 public:
  // Throws Error(kVerification) when a file of the map that is followed is missing or damaged: older records would come
  // to light again.
  RoundFiles(std::filesystem::path map_folder, const RoundFilesOptions& options);
  ~RoundFiles() override;

  bool follows() const override { return options_.follow; }
  bool interrupted_after(int number) const override;
  bool keeps_all() const override { return options_.keep_all; }
  bool time_to_save() const override;
  std::vector<TileId> tiles(int number) const override;
  std::optional<std::vector<std::uint8_t>> load(int number, TileId tile) const override;
  void save(int number, TileId tile, std::vector<std::uint8_t>&& record) override;
  void finish(int number) override;

  // One record in a file.
  struct Block {
    TileId tile;
    std::uint64_t offset = 0, stored_bytes = 0, bytes = 0, xxh3 = 0;  // of the stored bytes
  };

 private:
  struct Place {
    std::filesystem::path file;
    Block block;
  };
  struct Writing {
    std::unique_ptr<AtomicFile> file;
    std::uint64_t end = 0;
    std::vector<Block> blocks;
  };
  std::filesystem::path folder_;
  RoundFilesOptions options_;
  std::map<int, std::map<TileId, Place>> known_;
  std::set<int> interrupted_;  // numbers of which every rank's file is there
  mutable std::mutex mutex_;   // guards what follows
  std::map<int, Writing> writing_;
  mutable std::chrono::steady_clock::time_point last_saved_ = std::chrono::steady_clock::now();
};

// Whether a revision has left any.
bool has_round_files(const std::filesystem::path& map_folder, std::uint64_t revision);
// Those of a revision that was not published, and the folder when it is empty. Failures are ignored, as by the next.
void remove_round_files(const std::filesystem::path& map_folder, std::uint64_t revision);
// Names of those of the revisions `since` to `revision` whose index or records are damaged.
std::vector<std::string> damaged_round_files(const std::filesystem::path& map_folder, std::uint64_t revision,
                                             std::uint64_t since);
// Names of the files that hold what is newest of the revisions `since` to `revision`; none where `since` is 0.
std::vector<std::string> newest_round_files(const std::filesystem::path& map_folder, std::uint64_t revision,
                                            std::uint64_t since);
// After the publish of a revision that keeps the records from revision `since` on (0: none): removes the others, and
// files of which newer ones hold everything.
void prune_round_files(const std::filesystem::path& map_folder, std::uint64_t revision, std::uint64_t since);

}  // namespace btms
