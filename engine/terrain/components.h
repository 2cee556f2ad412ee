// Connected components by union-find (paper II-A, B-TGS). lcc is symmetric, so "reachable" does not need a visiting
// order: the nodes a breadth-first search would find are the members of a component, and its id is its smallest member.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace btms {

class Components {
 public:
  Components() = default;
  explicit Components(std::size_t n) { reset(n); }

  // n components of one member each; reuses memory.
  void reset(std::size_t n) {
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    if (parent_[a] == parent_[b]) return;
    a = find(a);
    b = find(b);
    if (a == b) return;
    if (a > b) std::swap(a, b);
    parent_[b] = a;
  }
  // Smallest member of the component.
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace btms
