// Between a map's reference system and those of the web: PROJ behind it.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engine/query/place.h"

namespace btms {

// Web Mercator (EPSG:3857) metres, WGS 84 degrees and the map's metres. Thread-safe: one caller at a time is at work.
class Projection {
 public:
  // Throws Error(kUsage) when the map names no system or one that leads nowhere.
  explicit Projection(const std::string& map_crs_wkt);
  ~Projection();

  // In place; what cannot be converted becomes infinite.
  void mercator_to_map(std::span<Place> places) const;
  void map_to_degrees(std::span<Place> places) const;  // x: longitude, y: latitude

 private:
  struct Systems;
  std::unique_ptr<Systems> systems_;
};

}  // namespace btms
