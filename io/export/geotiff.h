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

// A GeoTIFF that is larger than memory, in stripes from north to south. BigTIFF where it might pass 4 GiB.
class GeoTiffFile {
 public:
  // Rows and columns are of the whole file, as corner and edge of its squares are; its values are ignored.
  GeoTiffFile(const std::filesystem::path& path, const Window& whole, const std::string& crs_wkt);
  ~GeoTiffFile();
  GeoTiffFile(const GeoTiffFile&) = delete;
  GeoTiffFile& operator=(const GeoTiffFile&) = delete;

  // All stripes but the last have so many rows.
  static constexpr std::size_t kStripeRows = 256;
  // The next one, of all layers. Precondition: its columns are the file's.
  void put(const Window& stripe);
  // Nothing has the file's name before.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace btms
