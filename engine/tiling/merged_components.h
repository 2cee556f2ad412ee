// Components found tile by tile, joined over borders of tiles and of ranks. It sees ids and links only. Ids are what a
// component is called in its tile (the smallest member's).
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/terrain/components.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/paged.h"

namespace btms {

// Two components that an edge over a border joins.
template <class Id>
struct ComponentLink {
  Id a, b;
  friend auto operator<=>(const ComponentLink&, const ComponentLink&) = default;
};

// Both tiles of a border find its edges, and most of them many times.
template <class Id>
void sort_unique(std::vector<ComponentLink<Id>>& links) {
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
  links.shrink_to_fit();  // they are kept for every tile
}

// What all tiles of this rank have in one of their lists. Takes the lists: there may be much in them.
template <class Lists, class T>
std::vector<T> take_all(Paged<Lists>& by_tile, std::vector<T> Lists::*list) {
  std::vector<T> all;
  for (std::size_t i = 0; i < by_tile.size(); ++i) {
    const auto of_tile = by_tile.edit(i);
    std::vector<T>& part = (*of_tile).*list;
    all.insert(all.end(), part.begin(), part.end());
    std::vector<T>().swap(part);
  }
  return all;
}

// What all tiles of this rank have in these lists.
template <class Lists, class... T>
std::uint64_t bytes_in(Paged<Lists>& by_tile, std::vector<T> Lists::*... list) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < by_tile.size(); ++i) {
    const auto of_tile = by_tile.view(i);
    ((bytes += ((*of_tile).*list).size() * sizeof(T)), ...);
  }
  return bytes;
}

// The components of a rank's tiles, joined to whole ones. Those that other ranks have a part of, or touch, are public:
// all ranks know them, by the same numbers [0, publics()). The others, [publics(), size()), are known to this rank
// only. So what ranks tell each other grows with the borders between them, not with the map.
template <class Id>
class MergedComponents {
 public:
  // Collective. `components`: of this rank, each once and in any order (anything with an `id`). `links` between them,
  // or to one of another rank; every link is on at least one rank. `touched`: ids this rank will ask for, others' too.
  template <class Component>
  MergedComponents(const std::vector<Component>& components, const std::vector<ComponentLink<Id>>& links,
                   std::vector<Id> touched, Ranks& ranks)
      : ranks_(ranks) {
    own_.reserve(components.size());
    for (const Component& c : components) own_.push_back(c.id);
    std::sort(own_.begin(), own_.end());
    Components merged(own_.size());  // here
    std::vector<ComponentLink<Id>> abroad;
    for (const auto& link : links)
      if (is_own(link.a) && is_own(link.b))
        merged.unite(place_in(own_, link.a), place_in(own_, link.b));
      else
        abroad.push_back(link);

    // All that ranks name to each other.
    std::erase_if(touched, [&](const Id& id) { return is_own(id); });
    for (const auto& link : abroad) touched.insert(touched.end(), {link.a, link.b});
    sort_unique(touched);
    named_ = ranks.gather(touched);
    sort_unique(named_);

    // Its parts belong together where a link between ranks, or one of the ranks, says so.
    std::vector<Pair> same;
    for (const auto& link : abroad) same.push_back({place_in(named_, link.a), place_in(named_, link.b)});
    std::vector<std::uint32_t> first_named(own_.size(), kNone);  // by component here
    for (std::uint32_t k = 0; k < named_.size(); ++k) {
      if (!is_own(named_[k])) continue;
      std::uint32_t& first = first_named[merged.find(place_in(own_, named_[k]))];
      if (first == kNone) first = k;
      same.push_back({first, k});
    }
    Components whole(named_.size());
    for (const Pair& pair : ranks.gather(same)) whole.unite(pair.a, pair.b);
    public_.resize(named_.size());
    for (std::uint32_t k = 0; k < named_.size(); ++k) {
      const std::uint32_t root = whole.find(k);
      public_[k] = root == k ? publics_++ : public_[root];
    }

    size_ = publics_;
    number_.resize(own_.size());
    for (std::uint32_t i = 0; i < own_.size(); ++i) {
      const std::uint32_t root = merged.find(i), first = first_named[root];
      number_[i] = first != kNone ? public_[first] : root == i ? size_++ : number_[root];
    }
  }

  std::uint32_t size() const { return size_; }
  std::uint32_t publics() const { return publics_; }
  // What a component became part of. Precondition: id is one of this rank's, or one it has named.
  std::uint32_t whole(const Id& id) const {
    const std::uint32_t i = place_in(own_, id);
    return i < own_.size() && own_[i] == id ? number_[i] : public_[place_in(named_, id)];
  }
  // The first that counts when ranks count components: each public one is counted by one rank.
  std::uint32_t first_to_count() const { return ranks_.rank() == 0 ? 0 : publics_; }

  // Of values by component, what this rank knows of the public ones -> what all know together. Collective. Returns
  // whether any rank has raised its flag.
  template <class T>
  bool add_up(std::vector<T>& values, bool flag = false) const {
    if (ranks_.size() == 1) return flag;
    struct Part {
      T value;
      std::uint64_t number;
    };
    std::vector<Part> mine;
    for (std::uint32_t k = 0; k < publics_; ++k)
      if (values[k] != T{}) mine.push_back({std::exchange(values[k], T{}), k});
    if (flag) mine.push_back({T{}, kNone});
    bool any = false;
    for (const Part& part : ranks_.gather(mine))
      if (part.number == kNone)
        any = true;
      else
        values[part.number] += part.value;
    return any;
  }
  // Of `sets` of components, what this rank knows of the public ones -> what all know together. Collective.
  void unite_all(Components& sets) const {
    if (ranks_.size() == 1) return;
    std::vector<Pair> mine;
    for (std::uint32_t k = 0; k < publics_; ++k)
      if (const std::uint32_t first = sets.find(k); first != k) mine.push_back({first, k});
    for (const Pair& pair : ranks_.gather(mine)) sets.unite(pair.a, pair.b);
  }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Pair {
    std::uint32_t a, b;
  };
  static void sort_unique(std::vector<Id>& ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }
  static std::uint32_t place_in(const std::vector<Id>& ids, const Id& id) {
    return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  }
  bool is_own(const Id& id) const { return std::binary_search(own_.begin(), own_.end(), id); }

  Ranks& ranks_;
  std::vector<Id> own_, named_;        // ascending
  std::vector<std::uint32_t> number_;  // by place in own_
  std::vector<std::uint32_t> public_;  // by place in named_
  std::uint32_t publics_ = 0, size_ = 0;
};

}  // namespace btms
