// What planners ask of one revision of a map: how high the terrain is at a place, and what is known of it.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "engine/model/surface.h"
#include "engine/query/place.h"
#include "engine/query/tile_cache.h"

namespace btms {

enum class QueryStatus : std::uint8_t {
  kOk,
  kUnknown,  // the map is there, but has no surface
  kOutside,  // the map is not there, or the place is not a place (NaN, infinite)
  kDamaged,  // the tile could not be read
};
const char* query_status_name(QueryStatus status);  // "ok", "unknown", "outside", "damaged"
const char* node_state_name(NodeState state);       // "unknown", "observed", "predicted", "obstacle", "filled"

// Trivially copyable. Metres; what is not known is NaN, the normal then upright.
struct HeightAnswer {
  QueryStatus status = QueryStatus::kOutside;
  NodeState state = NodeState::kUnknown;  // of the node of the terrain there, whichever surface this is
  std::uint8_t surface = 0;               // 0: the terrain; n: the n-th further surface, in the order of the tile
  std::uint8_t surfaces = 0;              // how many there are at the place, the terrain among them; saturating
  float cost = std::numeric_limits<float>::infinity();  // of crossing, 0 to 1; infinite: not traversable. NaN: not
                                                        // known, of further surfaces that join the terrain
  double z_m = std::numeric_limits<double>::quiet_NaN();
  double variance_m2 = std::numeric_limits<double>::quiet_NaN();
  double normal[3] = {0, 0, 1};  // unit, z > 0
};

inline constexpr double kNoHint = std::numeric_limits<double>::quiet_NaN();

struct TerrainOptions {
  std::size_t cache_bytes = kDefaultCache_bytes;  // of decoded tiles
};

// An immutable view of one revision; copies share it. Thread-safe: any number of threads may ask the same object.
// Where the tile is in the cache, height() and heights() take no lock and allocate nothing; else the calling thread
// loads it. Places are rounded to the millimetre, as points are.
class Terrain {
 public:
  explicit Terrain(std::shared_ptr<const TileSource> map, const TerrainOptions& options = {});

  const MapLayout& layout() const { return tiles_->layout(); }
  // For what wants whole tiles.
  const TileCache& tiles() const { return *tiles_; }

  // Without a hint the terrain, or where it is unknown the lowest further surface that joins it somewhere. With a hint
  // (metres, of the same frame) the surface nearest to it. Heights of the terrain are those of surface_at(), to the
  // bit.
  HeightAnswer height(Place place, double z_hint_m = kNoHint) const noexcept;
  // The same of many: answers[i] of places[i], with hints_m[i] where there are any. Places that follow each other in a
  // tile are cheaper. Precondition: equal sizes.
  void heights(std::span<const Place> places, std::span<HeightAnswer> answers) const noexcept;
  void heights(std::span<const Place> places, std::span<const double> hints_m,
               std::span<HeightAnswer> answers) const noexcept;

  // Everything there is of a place: what `btms query` prints. Throws Error(kVerification) when the tile is damaged.
  struct Detail {
    QueryStatus status = QueryStatus::kOutside;
    SurfacePoint surface;           // where status is kOk
    std::vector<UpperPoint> upper;  // further surfaces, also where kUnknown
  };
  Detail detail(Place place) const;

 private:
  std::shared_ptr<const TileCache> tiles_;
};

}  // namespace btms
