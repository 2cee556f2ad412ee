// The fingerprint of a terrain model: the sum modulo 2^128 of XXH3-128 over every node's whole stored record (key, its
// three corner heights, every stored field) and every further surface. A sum does not depend on order, so the digest is the same for any tiling,
// thread count, rank count and input order, and equal digests mean equal models.
#pragma once

#include <cstdint>
#include <string>

#include "engine/model/terrain_tile.h"

namespace btms {

struct Digest {
  std::uint64_t low = 0;
  std::uint64_t high = 0;

  Digest& operator+=(const Digest& o) {
    low += o.low;
    high += o.high + (low < o.low ? 1 : 0);
    return *this;
  }
  friend bool operator==(const Digest&, const Digest&) = default;
  // 32 lower-case hex digits, high word first.
  std::string hex() const;
};

// Digest of one tile, whose `upper` is ascending as terrain_tile.h says. Nodes that hold nothing do not count, so cropping a tile to its content changes nothing; every
// known corner height of a finished tile belongs to a node that does.
Digest digest(const TerrainTile& tile);

}  // namespace btms
