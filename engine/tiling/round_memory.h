// What a build remembers of itself: per round of the coarse-to-fine method and per tile, the bytes that a later run needs
// to go on from there, or to recompute only what has changed. io/store keeps them in the map's folder.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/lattice/tiles.h"

namespace btms {

// Rounds count from 0 over all levels; records are opaque. load() and save() are thread-safe. A damaged record is one
// that is not there.
class RoundMemory {
 public:
  virtual ~RoundMemory() = default;
  // The rounds whose records were all saved by a run that was interrupted: it can be taken up after them. 0: afresh.
  virtual int rounds_done() const = 0;
  // What the newest run that finished the round has saved for the tile.
  virtual std::optional<std::vector<std::uint8_t>> load(int round, TileId tile) const = 0;
  // Keeps a record of this run; each tile at most once a round. A tile that isn't saved keeps what it had. Throws
  // Error(kFailed).
  virtual void save(int round, TileId tile, std::vector<std::uint8_t>&& record) = 0;
  // All records of this rank for the round are saved.
  virtual void finish_round(int round) = 0;
};

}  // namespace btms
