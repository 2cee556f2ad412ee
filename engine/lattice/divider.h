// Exact floor division of small offsets by a fixed cell edge, by multiplication and shift: a loop over it vectorises,
// where a division instruction costs twenty times as much.
#pragma once

#include <bit>
#include <cstdint>

namespace btms {

class Divider {
 public:
  static constexpr std::uint32_t kMaxOffset = (std::uint32_t{1} << 28) - 1;

  // Precondition: 1 <= divisor < 2^28.
  explicit constexpr Divider(std::uint32_t divisor)
      : shift_(28 + std::bit_width(divisor)), factor_((std::uint64_t{1} << shift_) / divisor + 1) {}

  // floor(offset / divisor). Precondition: offset <= kMaxOffset. The factor exceeds 2^shift / divisor by less than 1,
  // so the quotient is too large by less than offset / 2^shift < 1 / divisor: never enough to reach the next integer.
  constexpr std::uint32_t operator()(std::uint32_t offset) const {
    return static_cast<std::uint32_t>((std::uint64_t{offset} * factor_) >> shift_);
  }

 private:
  int shift_;
  std::uint64_t factor_;  // below 2^30
};

}  // namespace btms
