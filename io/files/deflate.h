// Deflate by ISA-L: the same input always gives the same bytes (with one version of the library).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

struct isal_zstream;

namespace btms {

inline constexpr int kDeflateLevel = 1;  // higher levels of ISA-L buy nothing here

enum class Wrapper { kNone, kZlib, kGzip };

// Keeps the compressor's memory for the next call: one object a thread.
class Deflater {
 public:
  explicit Deflater(Wrapper wrapper);
  ~Deflater();
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  // Bytes written to `out`; nothing where they don't fit. Precondition: both are shorter than 4 GiB.
  std::optional<std::size_t> deflate(std::span<const std::uint8_t> in, std::span<std::uint8_t> out);

 private:
  const Wrapper wrapper_;
  std::unique_ptr<isal_zstream> stream_;
  std::vector<std::uint8_t> work_;
};

}  // namespace btms
