// Values per node over a tile's interior and its halo, and the exchange that fills halos with copies.
//
// A pass reads interior and halo and writes the interior; between passes exchange_halo copies every halo node from the
// tile that owns it. Nothing else ever crosses a border.
#pragma once

#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/tiling/executor.h"
#include "engine/tiling/paged.h"
#include "engine/tiling/tile_changes.h"
#include "engine/tiling/tile_table.h"

namespace btms {

template <class T>
class TileField {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  TileField() = default;
  TileField(const CellBox& interior, std::int32_t halo)
      : interior_(interior),
        held_(interior.grown(halo)),
        values_(static_cast<std::size_t>(held_.cells()) * kTriangles) {}

  // A new box with values of T{}; reuses memory.
  void reset(const CellBox& interior, std::int32_t halo) {
    interior_ = interior;
    held_ = interior.grown(halo);
    values_.assign(static_cast<std::size_t>(held_.cells()) * kTriangles, T{});
  }

  const CellBox& interior() const { return interior_; }
  const CellBox& held() const { return held_; }
  std::int32_t halo() const { return interior_.col0 - held_.col0; }

  // The four values of a cell. Precondition: held() contains it.
  T* cell(Cell c) { return values_.data() + offset(c); }
  const T* cell(Cell c) const { return values_.data() + offset(c); }
  std::size_t offset(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - held_.row0) * held_.cols() + (c.col - held_.col0)) *
           kTriangles;
  }
  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(values_);
  }
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }

  void copy_box(const CellBox& box, const TileField& from) {
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      std::memcpy(cell({box.col0, row}), from.cell({box.col0, row}), row_bytes(box));
  }
  void pack(const CellBox& box, Bytes& out) const {
    for (std::int32_t row = box.row0; row < box.row1; ++row) {
      const auto* from = reinterpret_cast<const std::uint8_t*>(cell({box.col0, row}));
      out.insert(out.end(), from, from + row_bytes(box));
    }
  }
  // Returns the bytes taken.
  std::size_t unpack(const CellBox& box, const std::uint8_t* bytes) {
    for (std::int32_t row = box.row0; row < box.row1; ++row, bytes += row_bytes(box))
      std::memcpy(cell({box.col0, row}), bytes, row_bytes(box));
    return static_cast<std::size_t>(box.rows()) * row_bytes(box);
  }

 private:
  static std::size_t row_bytes(const CellBox& box) {
    return static_cast<std::size_t>(box.cols()) * kTriangles * sizeof(T);
  }

  CellBox interior_, held_;
  std::vector<T> values_;
};

// Fields of the tiles this rank owns; empty fields for the others. Index = TileTable index.
template <class T>
using TileFields = Paged<TileField<T>>;

// A strip on its way to another rank: which tile it is for, which cells it covers.
struct StripHeader {
  std::int64_t tile;  // of the first field's tiles, then those of the second, ...
  CellBox box;
};

template <class T>
void pack_strip(std::size_t tile, const CellBox& box, const TileField<T>& from, Bytes& out) {
  const StripHeader header{static_cast<std::int64_t>(tile), box};
  const auto* raw = reinterpret_cast<const std::uint8_t*>(&header);
  out.insert(out.end(), raw, raw + sizeof header);
  from.pack(box, out);
}

// Writes received strips into their tiles.
template <class T>
void unpack_strips(const std::vector<Bytes>& in, std::span<TileFields<T>* const> fields) {
  for (const Bytes& bytes : in)
    for (std::size_t at = 0; at < bytes.size();) {
      StripHeader header;
      std::memcpy(&header, bytes.data() + at, sizeof header);
      at += sizeof header;
      const auto tile = static_cast<std::size_t>(header.tile), tiles = fields[0]->size();
      at += fields[tile / tiles]->edit(tile % tiles)->unpack(header.box, bytes.data() + at);
    }
}

// The part of exchange_halo() that needs no other rank.
template <class T>
void copy_halo(const TileTable& table, TileFields<T>& fields, std::int32_t rings, const Threads& threads, int rank,
               const TileSet* only = nullptr) {
  const auto& tiles = table.tiles();
  threads.for_each(tiles.size(), [&](std::size_t i, int) {
    if (tiles[i].owner != rank || (only && !(*only)[i])) return;
    const auto to = fields.edit(i);
    table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& strip) {
      if (j != i && tiles[j].owner == rank) to->copy_box(strip, *fields.view(j));
    });
  });
}

// Fills the innermost `rings` rings of every halo of the fields with copies of the neighbours' interiors, with one
// exchange. `only`: of these tiles, the same on every rank; their neighbours have values. Collective.
template <class T>
void exchange_halos(const TileTable& table, std::span<TileFields<T>* const> fields, std::int32_t rings,
                    const Threads& threads, Ranks& ranks, const TileSet* only = nullptr) {
  for (TileFields<T>* field : fields) copy_halo(table, *field, rings, threads, ranks.rank(), only);
  if (ranks.size() == 1) return;

  const auto& tiles = table.tiles();
  const auto mine = [&](std::size_t i) { return tiles[i].owner == ranks.rank(); };
  std::vector<Bytes> out(static_cast<std::size_t>(ranks.size()));
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (mine(i) || (only && !(*only)[i])) continue;
    table.for_each_overlap(tiles[i].box.grown(rings), [&](std::size_t j, const CellBox& strip) {
      if (!mine(j)) return;
      for (std::size_t k = 0; k < fields.size(); ++k)
        pack_strip(k * tiles.size() + i, strip, *fields[k]->view(j), out[static_cast<std::size_t>(tiles[i].owner)]);
    });
  }
  unpack_strips(ranks.exchange(std::move(out)), fields);
}
template <class T>
void exchange_halo(const TileTable& table, TileFields<T>& field, std::int32_t rings, const Threads& threads,
                   Ranks& ranks, const TileSet* only = nullptr) {
  TileFields<T>* const one[] = {&field};
  exchange_halos<T>(table, one, rings, threads, ranks, only);
}

}  // namespace btms
