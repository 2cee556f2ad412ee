// The borders between shards: a corner that two of them hold has one height.
#pragma once

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/tiling/executor.h"
#include "io/store/manifest.h"

namespace btms {

struct SeamProblem {
  std::size_t first, second;  // shards, as counted in the manifest
  std::size_t corners;        // that differ
  Cell where;                 // the south-westernmost of them
  std::int32_t first_mm, second_mm;
};

// Shards come one by one, in any order; of each only the heights that a neighbour still has to be compared with are
// kept. Thread-safe.
class Seams {
 public:
  explicit Seams(const std::vector<ShardEntry>& shards);

  void add(std::size_t shard, const TerrainTile& content);
  // A shard whose heights are not known.
  void skip(std::size_t shard);
  // Where ranks have shards of their own: from here on every rank knows the problems of all. Collective.
  void join(Ranks& ranks);
  std::vector<SeamProblem> problems() const { return problems_; }

 private:
  using Pair = std::pair<std::size_t, std::size_t>;  // ascending
  struct Strip {
    bool of_first;                         // shard of the pair
    CellBox corners;                       // end column and row included
    std::vector<std::int32_t> heights_mm;  // none where they are not known
  };
  template <class Fn>
  void each_neighbour(std::size_t shard, Fn&& fn) const;
  void put(const Pair& pair, Strip strip);
  void compare(const Pair& pair, const Strip& first, const Strip& second);

  const std::vector<ShardEntry>& shards_;
  std::map<TileId, std::size_t> at_;
  std::mutex mutex_;  // guards what follows
  std::map<Pair, Strip> waiting_;
  std::vector<SeamProblem> problems_;
};

}  // namespace btms
