// The records of a build's rounds, read and written by what they hold.
#pragma once

#include <set>
#include <utility>

#include "engine/error.h"
#include "engine/tiling/record.h"
#include "engine/tiling/round_memory.h"
#include "engine/tiling/tile_table.h"

namespace btms {

// What a record is about. Rounds count over all levels; kPoints belongs to none.
enum class Step : int { kPoints, kNodes, kVerdicts, kRims, kSurface, kMisfit, kGround, kSheets, kJoined };

inline constexpr int kAfterRounds = 1 << 20;  // the "round" of what follows the last one
inline int record_number(int round, Step step) { return round * 16 + static_cast<int>(step); }

// Without a memory nothing is known and nothing is kept. Thread-safe.
class Records {
 public:
  explicit Records(RoundMemory* memory) : memory_(memory) {}

  // Whether this build follows another, of which everything is known.
  bool follow() const { return memory_ && memory_->follows(); }
  bool keep() const { return memory_ && memory_->keeps_all(); }
  RoundMemory* memory() const { return memory_; }
  // The map that is followed doesn't have this tile, whatever is left of one. Not while anything is loaded.
  void forget(TileId tile) { unknown_.insert(tile); }

  // False where the build before had no such tile, or another part of it.
  template <class... T>
  bool load(int number, TileId tile, const CellBox& box, std::vector<T>&... lists) const {
    return memory_ && !unknown_.contains(tile) && unpack_record(memory_->load(number, tile), box, lists...);
  }
  // What has to be there. Throws Error(kVerification) when it isn't.
  template <class... T>
  void recall(int number, TileId tile, const CellBox& box, std::vector<T>&... lists) const {
    require(load(number, tile, box, lists...), tile);
  }
  // Throws Error(kVerification) unless what has been loaded of the tile is sound.
  void require(bool sound, TileId tile) const {
    if (!sound)
      throw Error(ErrorCode::kVerification, "what the map remembers of tile " + std::to_string(tile.tx) + "," +
                                                std::to_string(tile.ty) +
                                                " is damaged: build the map anew, without --update or --resume");
  }
  template <class... T>
  void save(int number, TileId tile, const CellBox& box, const std::vector<T>&... lists) const {
    if (keep()) memory_->save(number, tile, pack_record(box, lists...));
  }
  void finish(int number) const {
    if (keep()) memory_->finish(number);
  }
  // Saved whatever is kept for later.
  template <class... T>
  void checkpoint(int number, TileId tile, const CellBox& box, const std::vector<T>&... lists) const {
    memory_->save(number, tile, pack_record(box, lists...));
  }

 private:
  RoundMemory* memory_;
  std::set<TileId> unknown_;
};

}  // namespace btms
