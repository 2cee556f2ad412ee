// Components found tile by tile, joined over borders. Global and small: it sees ids and links only, and every rank
// works out the same. Ids are what a component is called in its tile (the smallest member's).
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

// What all tiles of all ranks have in one of their lists. Takes the lists: there may be much in them.
template <class Lists, class T>
std::vector<T> gather_all(Ranks& ranks, Paged<Lists>& by_tile, std::vector<T> Lists::*list) {
  std::vector<T> mine;
  for (std::size_t i = 0; i < by_tile.size(); ++i) {
    const auto of_tile = by_tile.edit(i);
    std::vector<T>& part = (*of_tile).*list;
    mine.insert(mine.end(), part.begin(), part.end());
    std::vector<T>().swap(part);
  }
  return ranks.size() == 1 ? mine : ranks.gather(mine);
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

template <class Id>
class MergedComponents {
 public:
  // All components, each once and in any order (anything with an `id`), and the links between them.
  template <class Component>
  MergedComponents(const std::vector<Component>& components, const std::vector<ComponentLink<Id>>& links)
      : root_(components.size()) {
    for (const Component& c : components) ids_.push_back(c.id);
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
