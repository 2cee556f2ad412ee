// Progress and cancellation of a long run. The engine reports, the app draws.
#pragma once

#include <cstdint>
#include <string_view>

namespace btms {

// Thread-safe. The default does nothing and never stops.
class Progress {
 public:
  virtual ~Progress() = default;
  // A phase of `total` units (points or tiles, named by `unit`) begins.
  virtual void begin(std::string_view phase, std::uint64_t total, std::string_view unit) {
    (void)phase, (void)total, (void)unit;
  }
  // `done` more units are finished. Called about once per block or tile, never per point.
  virtual void advance(std::uint64_t done) { (void)done; }
  // True when the user wants to stop; the loop then throws Error(kCancelled) at the next block or tile.
  virtual bool stop_requested() const { return false; }
};

}  // namespace btms
