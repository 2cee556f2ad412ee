// Verdicts on components are the same however the components lie on ranks.
#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "engine/tiling/level_verdicts.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

struct Judged {
  NodeKey id;
  std::uint64_t rejected;
};

// Roofs in the middle of ground: each an island of `kParts` agreeing components, two thirds of them joined by a link
// that an edge over a border makes. Where an island's steps are, and what its parts hide, differs from part to part.
struct Town {
  static constexpr std::uint64_t kIslands = 300, kParts = 5;
  std::vector<LevelComponent> components;
  std::vector<LevelLink> links;
  std::vector<RimEdge> edges;

  explicit Town(std::uint64_t seed) {
    Random random(seed);
    const auto below = [&](std::uint64_t n) { return random.next() % n; };
    constexpr NodeKey kGround = 0;
    components.push_back({kGround, {1'000'000, 0, 50'000'000, 0, false, 0}});
    for (std::uint64_t i = 0; i < kIslands; ++i)
      for (std::uint64_t k = 0; k < kParts; ++k) {
        const NodeKey id = 1 + i * kParts + k;
        const std::uint64_t nodes = 10 + below(200);
        components.push_back({id, {nodes, 0, 50 * static_cast<std::int64_t>(nodes), below(20), k % 2 == 1, 0}});
        edges.push_back({kGround, id, kDownEdge, 1 + below(60)});
        edges.push_back({kGround, id, kLevelEdge, 1 + below(12)});
        if (k == 0) continue;
        edges.push_back({id - 1, id, kAgreeEdge, 1 + below(30)});
        edges.push_back({id - 1, id, below(2) ? kUpEdge : kLevelEdge, 1 + below(30)});
        if (k >= 2 && below(3) > 0) links.push_back({id - 2, id});
      }
  }
};

std::map<NodeKey, std::uint64_t> judge(const Town& town, int ranks) {
  std::map<NodeKey, std::uint64_t> all;
  run_forked_ranks(ranks, [&](Ranks& rank) {
    const auto mine = [&](NodeKey id) { return static_cast<int>(id * 7 / 3 % rank.size()) == rank.rank(); };
    std::vector<LevelComponent> components;
    std::vector<LevelLink> links;
    std::vector<RimEdge> edges;
    for (const LevelComponent& c : town.components)
      if (mine(c.id)) components.push_back(c);
    for (const LevelLink& link : town.links)
      if (mine(link.a) || mine(link.b)) links.push_back(link);  // both sides of a border find it
    for (const RimEdge& e : town.edges)
      if (mine(e.b)) edges.push_back(e);
    const LevelRules rules(LevelParameters{}, 2000, false, false);
    const LevelVerdicts verdicts(components, links, edges, rules, rank);
    std::vector<Judged> here;
    for (const LevelComponent& c : components) here.push_back({c.id, verdicts.is_rejected(c.id)});
    for (const RimEdge& e : edges) here.push_back({e.a, verdicts.is_rejected(e.a)});
    here.push_back({~NodeKey{0} - 1, verdicts.counts().all});
    here.push_back({~NodeKey{0}, verdicts.counts().kept});
    for (const Judged& j : rank.gather(here)) {
      const auto [known, is_new] = all.emplace(j.id, j.rejected);
      EXPECT_EQ(known->second, j.rejected) << "ranks disagree about " << j.id;
    }
  });
  return all;
}

TEST(InvarianceVerdicts, OnIslandsOfManyRanks) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Town town(seed);
    const auto alone = judge(town, 1);
    ASSERT_EQ(alone.size(), town.components.size() + 2);
    std::uint64_t rejected = 0;
    for (const LevelComponent& c : town.components) rejected += alone.at(c.id);
    ASSERT_GT(rejected, 100u);
    ASSERT_LT(rejected, town.components.size() - 100);
    for (const int ranks : {2, 3, 5}) ASSERT_EQ(judge(town, ranks), alone) << ranks << " ranks, seed " << seed;
  }
}

}  // namespace
}  // namespace btms::test
