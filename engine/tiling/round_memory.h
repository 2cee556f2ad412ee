// What a build remembers of itself: per tile and step of the coarse-to-fine method, what a later run needs to take it
// up there, or to recompute only what has changed since. io/store keeps it in the map's folder.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/lattice/tiles.h"

namespace btms {

// Records are opaque and numbered: what number stands for which step is build.h's affair. load() and save() are
// thread-safe. A damaged record is one that is not there.
class RoundMemory {
 public:
  virtual ~RoundMemory() = default;
  // Whether the map that is there was made by a finished build that kept its records: what follows it recomputes only
  // what has changed.
  virtual bool follows() const = 0;
  // Whether an interrupted build, which this one takes up, had saved all its records of this number. Always false of a
  // build that follows a finished one.
  virtual bool interrupted_after(int number) const = 0;
  // Whether all records are to be kept for later runs (else only those that an interrupted build is taken up from).
  virtual bool keeps_all() const = 0;
  // Whether it is time to save those that a build is taken up from.
  virtual bool time_to_save() const = 0;
  // All tiles of which the finished build has a record of this number.
  virtual std::vector<TileId> tiles(int number) const = 0;
  virtual std::optional<std::vector<std::uint8_t>> load(int number, TileId tile) const = 0;
  // Keeps a record; each tile at most once per number. A tile that isn't saved keeps the record it had. Throws
  // Error(kFailed).
  virtual void save(int number, TileId tile, std::vector<std::uint8_t>&& record) = 0;
  // All records of this rank with this number are saved.
  virtual void finish(int number) = 0;
};

}  // namespace btms
