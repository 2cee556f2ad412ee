// Components found tile by tile, joined over borders. Global and small: it sees ids and links only, and every rank
// works out the same. Ids are what a component is called in its tile (the smallest member's).
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/terrain/components.h"

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
}

template <class Id>
class MergedComponents {
 public:
  // `ids` of all components, without repetition, in any order; `links` between them.
  MergedComponents(std::vector<Id> ids, const std::vector<ComponentLink<Id>>& links)
      : ids_(std::move(ids)), root_(ids_.size()) {
    std::sort(ids_.begin(), ids_.end());
    Components merged(ids_.size());
    for (const auto& link : links) merged.unite(index(link.a), index(link.b));
    for (std::size_t i = 0; i < ids_.size(); ++i) root_[i] = merged.find(static_cast<std::uint32_t>(i));
  }

  std::size_t size() const { return ids_.size(); }
  // What a component became part of; is_root(i): it stands for the whole. Precondition: id is one of the ids.
  std::uint32_t root(const Id& id) const { return root_[index(id)]; }
  bool is_root(std::size_t i) const { return root_[i] == i; }

 private:
  std::uint32_t index(const Id& id) const {
    return static_cast<std::uint32_t>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin());
  }
  std::vector<Id> ids_;
  std::vector<std::uint32_t> root_;
};

}  // namespace btms
