// Integer random numbers for the scenes. Written out here because the bits are part of the contract: std::
// distributions differ between libraries.
#pragma once

#include <cstdint>

namespace btms {

inline constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;

// The finaliser of splitmix64 (Steele, Lea, Flood 2014): a bijection in which every input bit reaches every output bit.
constexpr std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

// A hash of a place on an integer lattice.
constexpr std::uint64_t hash_at(std::uint64_t seed, std::int64_t i, std::int64_t j = 0) {
  return mix(mix(seed + kGolden * static_cast<std::uint64_t>(i)) + kGolden * static_cast<std::uint64_t>(j));
}

// [0, 1) with 53 bits; exact.
constexpr double unit(std::uint64_t h) { return static_cast<double>(h >> 11) * 0x1p-53; }
// [-1, 1)
constexpr double signed_unit(std::uint64_t h) { return 2 * unit(h) - 1; }

// splitmix64. A value type: copying it repeats the sequence.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() { return mix(state_ += kGolden); }
  constexpr double uniform() { return unit(bits()); }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  constexpr int below(int n) { return static_cast<int>(uniform() * n); }
  constexpr bool chance(double p) { return uniform() < p; }
  // Bell-shaped, deviation 1, never beyond 3.47: the sum of four uniform 16-bit numbers.
  constexpr double bell() {
    const std::uint64_t h = bits();
    const auto sum = static_cast<double>((h & 0xffff) + ((h >> 16) & 0xffff) + ((h >> 32) & 0xffff) + (h >> 48));
    return (sum * 0x1p-16 - 2.0) * 1.7320508075688772;  // sqrt(12 / 4)
  }

 private:
  std::uint64_t state_;
};

}  // namespace btms
