// Cloud Optimized GeoTIFF, for readers that fetch parts of a file: made by GDAL's gdal_translate (package gdal-bin).
#pragma once

#include <filesystem>

namespace btms {

// Throws Error(kFailed) when there is no gdal_translate, or it fails. Values are those of `plain`; coarser copies in
// the file have values of it, none that are made up. The new file has its name when it is complete.
void write_cloud_geotiff(const std::filesystem::path& plain, const std::filesystem::path& file);

}  // namespace btms
