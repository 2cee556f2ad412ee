// Windows as GeoTIFF: float32, a band a layer, in tiles, deflated behind the floating-point predictor. Rows run from
// north to south, a pixel is a square's area, NaN is where there is nothing. Coordinates are in the unit of the
// reference system, whose EPSG code goes into the GeoKeys; one without a code goes there as text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/export/raster.h"
#include "io/files/atomic_file.h"

namespace btms {

// Throws Error(kFailed), like all of it; what describe_crs() throws.
std::vector<std::uint8_t> geotiff(const Window& window, const std::string& crs_wkt);

// A GeoTIFF that need not fit into memory. BigTIFF where it might pass 4 GiB.
class GeoTiffFile {
 public:
  // Extent, squares and layers are those of `outline`, whose values are ignored.
  GeoTiffFile(const std::filesystem::path& path, const Window& outline, const std::string& crs_wkt);
  ~GeoTiffFile();
  GeoTiffFile(const GeoTiffFile&) = delete;
  GeoTiffFile& operator=(const GeoTiffFile&) = delete;

  static constexpr std::size_t kTileEdge = 256;
  // All layers of a part, once. Rows count from the north. Precondition: row0 and col0 are multiples of kTileEdge, and
  // so are the part's rows and columns, but for the last.
  void put(std::size_t row0, std::size_t col0, const Window& part);
  // The file has its name, and is on disk.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace btms
