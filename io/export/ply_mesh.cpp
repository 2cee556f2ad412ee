#include "io/export/ply_mesh.h"

#include <fmt/format.h>

#include "engine/error.h"
#include "io/export/local_origin.h"
#include "io/export/shading.h"
#include "io/files/file_section.h"

namespace btms {
namespace {

constexpr std::uint64_t kVertex_bytes = 6 * 4 + 4;

std::string header_of(const MapInfo& info, int level, const MeshSize& size, const LocalOrigin& origin) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "comment B-TMS terrain, revision {}, level {}; metres, x east, y north, z up\n"
      "comment origin_m {} {} 0 (add it to x, y, z)\n"
      "comment state: 1 observed, 2 predicted, 3 obstacle, 4 filled\n"
      "comment crs {}\n"
      "element vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar state\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      info.revision, level, origin.x_m(), origin.y_m(), one_line(info.crs_wkt), size.vertices, size.triangles);
}

}  // namespace

MeshSize write_ply_mesh(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                        const std::filesystem::path& path) {
  const MeshSize size = measure_surface(tiles, level, box);
  const LocalOrigin origin = LocalOrigin::below(size.min_mm[0], size.min_mm[1]);
  const std::string header = header_of(map.info(), level, size, origin);
  AtomicFile file(path);
  FileSection vertices(file, 0), faces(file, header.size() + size.vertices * kVertex_bytes);
  vertices.put(header);
  walk_surface(tiles, level, box, [&](std::span<const MeshVertex> some, std::span<const MeshTriangle> triangles) {
    for (const MeshVertex& v : some) {
      const Rgb colour = state_colour(v.state);
      vertices.put(origin.local_x(v.x_mm), origin.local_y(v.y_mm), static_cast<float>(v.z_mm / 1000.0), v.normal[0],
                   v.normal[1], v.normal[2], colour.r, colour.g, colour.b, static_cast<std::uint8_t>(v.state));
    }
    for (const MeshTriangle& t : triangles) faces.put(std::uint8_t{3}, t[0], t[1], t[2]);
  });
  vertices.flush();
  faces.flush();
  file.commit();
  return size;
}

}  // namespace btms
