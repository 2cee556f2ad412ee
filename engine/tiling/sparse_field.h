// Values at a few nodes of a tile and its halo, any number at one node; and the exchange that fills halos. What
// tile_field.h is for values at every node.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "engine/tiling/executor.h"
#include "engine/tiling/paged.h"
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

  // Sorts what is given; interior and halo.
  void assign(const std::vector<T>& values) {
    begin_.assign(static_cast<std::size_t>(held_.cells()) * kTriangles + 2, 0);
    for (const T& v : values) ++begin_[node_index(node_of_key(v.node)) + 2];
    for (std::size_t k = 2; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
    values_.resize(values.size());
    for (const T& v : values) values_[begin_[node_index(node_of_key(v.node)) + 1]++] = v;
    begin_.pop_back();
    // What a node has comes from one place, mostly in order.
    for (std::size_t k = 0; k + 1 < values_.size(); ++k)
      if (values_[k + 1] < values_[k]) return std::sort(values_.begin(), values_.end());
  }

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(values_), fn(begin_);
  }
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }
  // Positions in values() of those of a node, [begin, end). Precondition: held() contains its cell.
  std::uint32_t begin(NodeId n) const { return begin_[node_index(n)]; }
  std::uint32_t end(NodeId n) const { return begin_[node_index(n) + 1]; }

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
  std::vector<std::uint32_t> begin_;  // per node of held(), and one more
};

template <class T>
using SparseFields = Paged<SparseField<T>>;

// Fills the innermost `rings` rings of every halo with copies of the neighbours' interiors; what a halo held before is
// forgotten. Collective.
template <class T>
void exchange_halo(const TileTable& table, SparseFields<T>& fields, std::int32_t rings, const Threads& threads,
                   Ranks& ranks) {
  const auto& tiles = table.tiles();
  const auto mine = [&](std::size_t i) { return tiles[i].owner == ranks.rank(); };
  Paged<std::vector<T>> filled(fields.pager(), tiles.size());
  threads.for_each(tiles.size(), [&](std::size_t i, int) {
    if (!mine(i)) return;
    const auto to = filled.edit(i);
    table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& part) {
      if (mine(j)) fields.view(j)->append(part, *to);
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
      if (mine(i)) continue;
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
    if (!mine(i)) return;
    fields.edit(i)->assign(*filled.view(i));
    filled.drop(i);
  });
}

}  // namespace btms
