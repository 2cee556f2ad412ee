// The journal of a build: which shards it has committed, so that an interrupted one can be taken up.
// docs/store_format.md
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/files/descriptor.h"
#include "io/store/manifest.h"

namespace btms {

// What has to be the same for a build to be taken up: parameters, layout, reference system, inputs. One line of JSON.
std::string build_identity(const MapInfo& info);
// The members in which two identities differ, as text for a message; empty when they are equal.
std::string identity_difference(const std::string& a, const std::string& b);

inline constexpr char kJournal[] = "journal";
// That of a rank: journal, journal.1, ...
std::string journal_name(int rank);
bool is_journal_name(const std::string& name);

// Appends to the journal of a rank; every line has its own hash, so a torn one is noticed. Not thread-safe.
class Journal {
 public:
  // Begins it where there is none; of one that is there it keeps the sound lines. Throws Error(kFailed), like add().
  Journal(const std::filesystem::path& folder, int rank, std::uint64_t revision, const std::string& identity);
  // On disk when it returns. The shards' files and their names must be already.
  void add(const std::vector<ShardEntry>& shards);

 private:
  void append(const std::string& text);
  std::filesystem::path path_;
  Descriptor fd_;
};

// The journals of a folder, of all ranks: those that belong to the first head that is met.
struct Interrupted {
  std::uint64_t revision = 0;
  std::string identity;
  std::vector<std::string> entries;  // of shards, as JSON
};
// Nothing where there is none. Lines that are damaged, and what follows them, are left out.
std::optional<Interrupted> read_journals(const std::filesystem::path& folder);
// The entries that fit the layout; of a shard that is named twice, the last.
std::vector<ShardEntry> journaled_shards(const Interrupted& interrupted, const MapLayout& layout);

void remove_journals(const std::filesystem::path& folder);

}  // namespace btms
