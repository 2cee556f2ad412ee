// What the engine needs of a point file. io/points implements it for every format, engine/scenes for synthetic worlds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/lattice/coordinates.h"

namespace btms {

// Consecutive points of a source in input order, as structure of arrays, integer millimetres in the map frame.
// A dropped point (not finite, out of range) keeps its place: its x is kDroppedX.
struct PointBlock {
  static constexpr std::int64_t kDroppedX = std::numeric_limits<std::int64_t>::min();

  std::vector<std::int64_t> x_mm, y_mm;
  std::vector<std::int32_t> z_mm;
  std::vector<std::uint8_t> bytes;  // reader's scratch, kept between calls
  bool keep_records = false;        // asks for the raw records of all points at the start of `bytes`: who has a use for
                                    // them knows whether the source has such
  std::size_t not_finite = 0;       // dropped: NaN or infinite
  std::size_t out_of_range = 0;     // dropped: beyond kMaxHorizontal_mm or kMaxVertical_mm
  std::size_t outside_box = 0;      // kept, although outside the box that their file declares

  std::size_t size() const { return x_mm.size(); }
  std::size_t dropped() const { return not_finite + out_of_range; }
  // Sizes the arrays to n (contents undefined) and clears the counts. Never shrinks capacity.
  void reset(std::size_t n) {
    x_mm.resize(n);
    y_mm.resize(n);
    z_mm.resize(n);
    not_finite = out_of_range = outside_box = 0;
  }
};

// Random access to a sequence of points. Thread-safe for concurrent reads with different blocks.
class PointSource {
 public:
  virtual ~PointSource() = default;
  virtual std::string name() const = 0;  // for messages: the path
  virtual std::uint64_t size() const = 0;
  // Reads points [first, first + count) into `block` (reset to count). Precondition: the range lies inside size().
  // Throws Error(kBadInput) with file and offset when the file is damaged or changed while being read.
  virtual void read(std::uint64_t first, std::size_t count, PointBlock& block) const = 0;
};

}  // namespace btms
