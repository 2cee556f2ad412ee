// Values at a few nodes of a tile and its halo, any number at one node; and the exchange that fills halos. What
// tile_field.h is for values at every node.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "engine/tiling/executor.h"
#include "engine/tiling/paged.h"
#include "engine/tiling/tile_changes.h"
#include "engine/tiling/tile_table.h"

namespace btms {

// T is trivially copyable, has a `NodeKey node`, and is ordered by it first.
template <class T>
class SparseField {
 public:
  SparseField() = default;
  SparseField(const CellBox& interior, std::int32_t halo) : interior_(interior), held_(interior.grown(halo)) {}

  const CellBox& interior() const { return interior_; }
  const CellBox& held() const { return held_; }

  // Sorts what the interior has; the halo has nothing.
  void assign(const std::vector<T>& values) {
    const std::size_t nodes = static_cast<std::size_t>(held_.cells()) * kTriangles;
    end_.assign(nodes, 0);
    for (const T& v : values) ++end_[node_index(node_of_key(v.node))];
    begin_.resize(nodes);
    std::uint32_t sum = 0;
    for (std::size_t k = 0; k < nodes; ++k) {
      begin_[k] = sum;
      sum += std::exchange(end_[k], sum);
    }
    values_.resize(values.size());
    for (const T& v : values) values_[end_[node_index(node_of_key(v.node))]++] = v;
    inside_ = values.size();
    // What a node has comes from one place, mostly in order.
    if (!std::is_sorted(values_.begin(), values_.end())) std::sort(values_.begin(), values_.end());
  }
  // Replaces what the halo has.
  void assign_halo(std::vector<T>& values) {
    for (const T& v : std::span(values_).subspan(inside_)) {
      const std::size_t k = node_index(node_of_key(v.node));
      begin_[k] = end_[k] = 0;
    }
    std::sort(values.begin(), values.end());
    values_.resize(inside_);
    values_.insert(values_.end(), values.begin(), values.end());
    for (std::size_t i = inside_; i < values_.size(); ++i) {
      const std::size_t k = node_index(node_of_key(values_[i].node));
      if (i == inside_ || values_[i].node != values_[i - 1].node) begin_[k] = static_cast<std::uint32_t>(i);
      end_[k] = static_cast<std::uint32_t>(i + 1);
    }
  }

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(values_), fn(begin_), fn(end_);
  }
  // Those of the interior in ascending order, then those of the halo.
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }
  std::span<T> inside() { return std::span(values_).first(inside_); }
  std::span<const T> inside() const { return std::span(values_).first(inside_); }
  // Positions in values() of those of a node, [begin, end). Precondition: held() contains its cell.
  std::uint32_t begin(NodeId n) const { return begin_[node_index(n)]; }
  std::uint32_t end(NodeId n) const { return end_[node_index(n)]; }

  // Precondition: the interior contains the box.
  void append(const CellBox& box, std::vector<T>& out) const {
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      out.insert(out.end(), values_.begin() + begin({{box.col0, row}, 0}),
                 values_.begin() + end({{box.col1 - 1, row}, kTriangles - 1}));
  }

 private:
  std::size_t node_index(NodeId n) const {
    return static_cast<std::size_t>((std::int64_t{n.cell.row} - held_.row0) * held_.cols() +
                                    (n.cell.col - held_.col0)) *
               kTriangles +
           n.triangle;
  }

  CellBox interior_, held_;
  std::vector<T> values_;
  std::size_t inside_ = 0;
  std::vector<std::uint32_t> begin_, end_;  // per node of held()
};

template <class T>
using SparseFields = Paged<SparseField<T>>;

// Fills the innermost `rings` rings of every halo with copies of the neighbours' interiors; what a halo held before is
// forgotten. `only`: of these tiles, the same on every rank. Collective.
template <class T>
void exchange_halo(const TileTable& table, SparseFields<T>& fields, std::int32_t rings, const Threads& threads,
                   Ranks& ranks, const TileSet* only = nullptr) {
  const auto& tiles = table.tiles();
  const auto mine = [&](std::size_t i) { return tiles[i].owner == ranks.rank(); };
  const auto wanted = [&](std::size_t i) { return !only || (*only)[i]; };
  Paged<std::vector<T>> filled(fields.pager(), tiles.size());
  threads.for_each(tiles.size(), [&](std::size_t i, int) {
    if (!mine(i) || !wanted(i)) return;
    const auto to = filled.edit(i);
    table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& part) {
      if (j != i && mine(j)) fields.view(j)->append(part, *to);
    });
  });
  if (ranks.size() > 1) {
    struct Addressed {
      std::uint64_t tile;
      T value;
    };
    std::vector<Bytes> out(static_cast<std::size_t>(ranks.size()));
    std::vector<T> strip;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (mine(i) || !wanted(i)) continue;
      strip.clear();
      table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& part) {
        if (mine(j)) fields.view(j)->append(part, strip);
      });
      Bytes& to = out[static_cast<std::size_t>(tiles[i].owner)];
      for (const T& value : strip) {
        const Addressed a{i, value};
        const auto* raw = reinterpret_cast<const std::uint8_t*>(&a);
        to.insert(to.end(), raw, raw + sizeof a);
      }
    }
    for (const Bytes& in : ranks.exchange(std::move(out)))
      for (std::size_t at = 0; at < in.size(); at += sizeof(Addressed)) {
        Addressed a;
        std::memcpy(&a, in.data() + at, sizeof a);
        filled.edit(static_cast<std::size_t>(a.tile))->push_back(a.value);
      }
  }
  threads.for_each(tiles.size(), [&](std::size_t i, int) {
    if (!mine(i) || !wanted(i)) return;
    fields.edit(i)->assign_halo(*filled.edit(i));
    filled.drop(i);
  });
}

}  // namespace btms
