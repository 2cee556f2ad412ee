// The verdicts on the components of one round of a level (step 6 of the coarse-to-fine method), from what tiles know of
// them: sums and rims, no nodes.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "engine/terrain/level_links.h"
#include "engine/tiling/merged_components.h"
#include "engine/tiling/passes.h"

namespace btms {

enum EdgeKind : std::uint8_t { kLevelEdge = 0, kUpEdge = 1, kDownEdge = 2, kAgreeEdge = 3 };

struct LevelComponent {
  NodeKey id;
  ComponentSums sums;
};
using LevelLink = ComponentLink<NodeKey>;
// Edges of one kind between two components; kUpEdge: a stands above b.
struct RimEdge {
  NodeKey a, b;
  std::uint64_t kind;
  std::uint64_t count;
  friend bool operator<(const RimEdge& x, const RimEdge& y) {
    return std::tie(x.a, x.b, x.kind) < std::tie(y.a, y.b, y.kind);
  }
  bool same(const RimEdge& o) const { return a == o.a && b == o.b && kind == o.kind; }
};

class LevelVerdicts {
 public:
  // Collective. `components`, `links` and `edges` are those of this rank's tiles; an edge is listed once among all.
  LevelVerdicts(const std::vector<LevelComponent>& components, const std::vector<LevelLink>& links,
                const std::vector<RimEdge>& edges, const LevelRules& rules, Ranks& ranks);

  // Precondition: the id of a component of this rank, or of one that an edge or a link here leads to.
  bool is_rejected(NodeKey id) const { return rejected_[merged_.whole(id)] != 0; }
  // Of all ranks.
  const ComponentCounts& counts() const { return counts_; }

 private:
  // Edges of one kind between whole components.
  struct Rim {
    std::uint32_t a, b;
    std::uint64_t kind, count;
  };
  static void count(RimCounts& rim, const ComponentSums& mine, const ComponentSums& other, bool other_rejected,
                    const Rim& e, bool up);
  std::vector<std::uint8_t> on_rejected_islands(const std::vector<ComponentSums>& sums,
                                                const std::vector<Rim>& edges) const;

  MergedComponents<NodeKey> merged_;
  std::vector<std::uint8_t> rejected_;
  ComponentCounts counts_;
};

}  // namespace btms
