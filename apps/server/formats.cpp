#include "apps/server/formats.h"

#include <span>

#include "apps/server/problem.h"
#include "apps/server/served_map.h"
#include "io/export/geotiff.h"
#include "io/export/raw_tile.h"
#include "io/export/window_formats.h"

namespace btms {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes text(const std::string& t) { return {t.begin(), t.end()}; }

constexpr WindowFormat kRaw{"raw", "application/octet-stream",
                            [](const Window& w, TileId id, const MapRevision&) { return raw_tile(w, id); }};
constexpr WindowFormat kNpy{"npy", "application/x-npy",
                            [](const Window& w, TileId, const MapRevision&) { return npy(w); }};
constexpr WindowFormat kNpz{"npz", "application/zip",
                            [](const Window& w, TileId, const MapRevision&) { return npz(w); }};
constexpr WindowFormat kPng{"png", "image/png",
                            [](const Window& w, TileId, const MapRevision&) { return window_png(w); }};
constexpr WindowFormat kTif{
    "tif", "image/tiff; application=geotiff",
    [](const Window& w, TileId, const MapRevision& r) { return geotiff(w, r.reader->info().crs_wkt); }};
constexpr WindowFormat kJson{"json", "application/json",
                             [](const Window& w, TileId, const MapRevision&) { return text(window_json(w)); }};
constexpr WindowFormat kGridmap{"gridmap-json", "application/json", [](const Window& w, TileId, const MapRevision&) {
                                  return text(gridmap_json(w, "map"));
                                }};

constexpr WindowFormat kChunk{"chunk", "application/octet-stream", nullptr};

constexpr WindowFormat kTileFormats[] = {kRaw, kNpy, kPng, kTif, kJson, kChunk};
constexpr WindowFormat kSubmapFormats[] = {kRaw, kNpy, kNpz, kPng, kTif, kJson, kGridmap};

const WindowFormat& find(std::span<const WindowFormat> formats, const std::string& name) {
  std::vector<std::string> allowed;
  for (const WindowFormat& format : formats) {
    if (name == format.name) return format;
    allowed.emplace_back(format.name);
  }
  throw Problem("bad_parameter", "no such form", "f", allowed);
}

}  // namespace

const WindowFormat& tile_format(const std::string& name) { return find(kTileFormats, name); }
const WindowFormat& submap_format(const std::string& name) { return find(kSubmapFormats, name); }

}  // namespace btms
