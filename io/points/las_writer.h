// Writes a new LAS 1.4 file (point format 6 or 0, scale 0.001), for synthetic scenes and tests.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace btms {

// 6: 30 bytes a point, any class. 0: 20 bytes, classes up to 31, at most 2^32 - 1 points.
enum class LasPointFormat : std::uint8_t { k0 = 0, k6 = 6 };

struct LasPoint {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
  std::uint8_t classification = 0;
  std::uint16_t intensity = 0;
};

// Not thread-safe. Header (count, bounds) is written by commit(); without commit() the temporary file is removed.
class LasWriter {
 public:
  // `crs_wkt` may be empty. Coordinates must lie within +-2 147 km of the offset, which is chosen from the first point,
  // rounded to whole kilometres. append() throws Error(kFailed) for what the format
  // cannot hold, and everything throws it for a failed write.
  static std::unique_ptr<LasWriter> create(const std::filesystem::path& path, const std::string& crs_wkt = {},
                                           LasPointFormat format = LasPointFormat::k6);
  virtual ~LasWriter() = default;
  virtual void append(std::span<const LasPoint> points) = 0;
  virtual void commit() = 0;
};

}  // namespace btms
