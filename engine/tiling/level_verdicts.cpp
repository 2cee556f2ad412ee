#include "engine/tiling/level_verdicts.h"

#include <cstddef>

#include "engine/terrain/components.h"

namespace btms {
namespace {

// What the edges lead to: components that will be asked for.
std::vector<NodeKey> ends_of(const std::vector<RimEdge>& edges) {
  std::vector<NodeKey> ends;
  for (const RimEdge& e : edges) ends.insert(ends.end(), {e.a, e.b});
  return ends;
}

}  // namespace

LevelVerdicts::LevelVerdicts(const std::vector<LevelComponent>& components, const std::vector<LevelLink>& links,
                             const std::vector<RimEdge>& edges, const LevelRules& rules, Ranks& ranks)
    : merged_(components, links, ends_of(edges), ranks), rejected_(merged_.size(), 0) {
  std::vector<ComponentSums> sums(merged_.size());
  for (const LevelComponent& c : components) sums[merged_.whole(c.id)] += c.sums;
  merged_.add_up(sums);
  std::vector<Rim> between;
  for (const RimEdge& e : edges)
    if (const Rim rim{merged_.whole(e.a), merged_.whole(e.b), e.kind, e.count}; rim.a != rim.b) between.push_back(rim);

  // Judged with all components standing, like the first round: what is gone says nothing about walls.
  const std::vector<std::uint8_t> on_island = rules.first() ? rejected_ : on_rejected_islands(sums, between);
  std::vector<RimCounts> rims(merged_.size());
  bool changed = true;  // by the round before, on this rank
  for (int round = 0; round < rules.p().rejection_rounds; ++round) {
    rims.assign(merged_.size(), RimCounts{});
    for (const Rim& e : between) {
      count(rims[e.a], sums[e.a], sums[e.b], rejected_[e.b], e, e.kind == kUpEdge);
      count(rims[e.b], sums[e.b], sums[e.a], rejected_[e.a], e, e.kind == kDownEdge);
    }
    if (!merged_.add_up(rims, changed)) break;
    changed = false;
    for (std::size_t i = 0; i < merged_.size(); ++i)
      if (!rejected_[i] && (on_island[i] || rejected(sums[i], rims[i], rules))) rejected_[i] = 1, changed = true;
  }

  std::uint64_t kept = 0;
  for (std::uint32_t i = merged_.first_to_count(); i < merged_.size(); ++i) kept += !rejected_[i];
  const auto all = ranks.sum<std::uint64_t>({merged_.size() - merged_.first_to_count(), kept});
  counts_ = {all[0], all[1]};
}

// One kind of edge as `mine` sees it, towards `other`. An edge up counts only against a component at least as large:
// nothing is a roof because of a pit beside it.
void LevelVerdicts::count(RimCounts& rim, const ComponentSums& mine, const ComponentSums& other, bool other_rejected,
                          const Rim& e, bool up) {
  if (other_rejected) return;
  if (e.kind == kAgreeEdge) {
    rim.agree += e.count;
    return;
  }
  if (up && other.nodes < mine.nodes) return;
  rim.rim += e.count;
  if (up) rim.up += e.count;
}

// Which components go with their whole island. An island with a public component is called by it: those come first.
std::vector<std::uint8_t> LevelVerdicts::on_rejected_islands(const std::vector<ComponentSums>& sums,
                                                             const std::vector<Rim>& edges) const {
  Components islands(merged_.size());
  for (const Rim& e : edges)
    if (e.kind == kAgreeEdge) islands.unite(e.a, e.b);
  merged_.unite_all(islands);
  const auto island = [&](std::uint32_t i) { return islands.find(i); };
  std::vector<ComponentSums> whole(merged_.size());
  for (std::uint32_t i = merged_.first_to_count(); i < merged_.size(); ++i) whole[island(i)] += sums[i];
  merged_.add_up(whole);
  std::vector<RimCounts> rims(merged_.size());
  for (const Rim& e : edges) {
    const std::uint32_t a = island(e.a), b = island(e.b);
    if (a == b) continue;
    count(rims[a], whole[a], whole[b], false, e, e.kind == kUpEdge);
    count(rims[b], whole[b], whole[a], false, e, e.kind == kDownEdge);
  }
  merged_.add_up(rims);
  std::vector<std::uint8_t> out(merged_.size());
  for (std::uint32_t i = 0; i < merged_.size(); ++i) out[i] = rejected_island(whole[island(i)], rims[island(i)]);
  return out;
}

}  // namespace btms
