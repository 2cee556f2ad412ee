#include "io/export/glb_mesh.h"

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/error.h"
#include "io/export/local_origin.h"
#include "io/export/shading.h"
#include "io/files/file_section.h"

namespace btms {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kVertex_bytes = 6 * 4 + 4, kTriangle_bytes = 3 * 4;

// glTF's colours are linear, those of pictures are sRGB.
std::uint8_t linear(std::uint8_t srgb) {
  const double v = srgb / 255.0;
  return static_cast<std::uint8_t>(255 * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4)) + 0.5);
}

std::array<Rgb, 5> linear_colours() {
  std::array<Rgb, 5> colours;
  for (std::size_t s = 0; s < colours.size(); ++s) {
    const Rgb c = state_colour(static_cast<NodeState>(s));
    colours[s] = {linear(c.r), linear(c.g), linear(c.b)};
  }
  return colours;
}

std::array<float, 3> position(const LocalOrigin& origin, std::int64_t x_mm, std::int64_t y_mm, std::int64_t z_mm) {
  return {origin.local_x(x_mm), static_cast<float>(static_cast<double>(z_mm) / 1000), -origin.local_y(y_mm)};
}

Json document(const MapInfo& info, int level, const MeshSize& size, const LocalOrigin& origin) {
  constexpr int kFloat = 5126, kByte = 5121, kIndex = 5125, kVertices = 34962, kIndices = 34963;
  const std::array<std::int64_t, 3>& a = size.min_mm;
  const std::array<std::int64_t, 3>& b = size.max_mm;
  const std::uint64_t vertex_bytes = size.vertices * kVertex_bytes, index_bytes = size.triangles * kTriangle_bytes;
  Json extras{{"origin_m", {origin.x_m(), origin.y_m(), 0}},
              {"axes", "x east, y up, z south; add origin_m to x, -z, y"},
              {"level", level},
              {"edge_m", std::ldexp(info.layout.lattice.resolution_m(), level)},
              {"revision", info.revision},
              {"digest", info.digest.hex()},
              {"crs_wkt", info.crs_wkt}};
  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "btms export"}, {"extras", std::move(extras)}};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", {0}}}});
  json["nodes"] = Json::array({{{"mesh", 0}, {"name", "terrain"}}});
  json["meshes"] = Json::array(
      {{{"primitives",
         Json::array(
             {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}}, {"indices", 3}, {"material", 0}}})}}});
  json["materials"] = Json::array({{{"name", "state of the terrain"},
                                    {"doubleSided", true},
                                    {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}});
  json["buffers"] = Json::array({{{"byteLength", vertex_bytes + index_bytes}}});
  json["bufferViews"] =
      Json::array({{{"buffer", 0}, {"byteLength", vertex_bytes}, {"byteStride", kVertex_bytes}, {"target", kVertices}},
                   {{"buffer", 0}, {"byteOffset", vertex_bytes}, {"byteLength", index_bytes}, {"target", kIndices}}});
  const auto attribute = [&](int offset, int component, const char* type) {
    return Json{{"bufferView", 0},
                {"byteOffset", offset},
                {"componentType", component},
                {"count", size.vertices},
                {"type", type}};
  };
  Json positions = attribute(0, kFloat, "VEC3"), normals = attribute(12, kFloat, "VEC3"),
       colours = attribute(24, kByte, "VEC4");
  positions["min"] = position(origin, a[0], b[1], a[2]);
  positions["max"] = position(origin, b[0], a[1], b[2]);
  colours["normalized"] = true;
  json["accessors"] =
      Json::array({std::move(positions),
                   std::move(normals),
                   std::move(colours),
                   {{"bufferView", 1}, {"componentType", kIndex}, {"count", 3 * size.triangles}, {"type", "SCALAR"}}});
  return json;
}

}  // namespace

MeshSize write_glb_mesh(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                        const std::filesystem::path& path) {
  constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;
  constexpr std::uint64_t kHeader_bytes = 12, kChunkHeader_bytes = 8;
  const MeshSize size = measure_surface(tiles, level, box);
  const LocalOrigin origin = LocalOrigin::below(size.min_mm[0], size.min_mm[1]);
  std::string text = document(map.info(), level, size, origin).dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t vertex_bytes = size.vertices * kVertex_bytes,
                      binary_bytes = vertex_bytes + size.triangles * kTriangle_bytes,
                      begin = kHeader_bytes + kChunkHeader_bytes + text.size() + kChunkHeader_bytes,
                      all_bytes = begin + binary_bytes;
  if (all_bytes > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorCode::kUsage, "a .glb holds at most 4 GiB; ask for a part (--bbox) or a coarser --level", path);

  AtomicFile file(path);
  FileSection vertices(file, 0), indices(file, begin + vertex_bytes);
  vertices.put(kMagic, kVersion, static_cast<std::uint32_t>(all_bytes));
  vertices.put(static_cast<std::uint32_t>(text.size()), kJson);
  vertices.put(text);
  vertices.put(static_cast<std::uint32_t>(binary_bytes), kBinary);
  const std::array<Rgb, 5> colours = linear_colours();
  walk_surface(tiles, level, box, [&](std::span<const MeshVertex> some, std::span<const MeshTriangle> triangles) {
    for (const MeshVertex& v : some) {
      const auto [x, y, z] = position(origin, v.x_mm, v.y_mm, v.z_mm);
      const Rgb c = colours[static_cast<std::size_t>(v.state)];
      vertices.put(x, y, z, v.normal[0], v.normal[2], -v.normal[1], c.r, c.g, c.b, std::uint8_t{255});
    }
    for (const MeshTriangle& t : triangles) indices.put(t[0], t[1], t[2]);
  });
  vertices.flush();
  indices.flush();
  file.commit();
  return size;
}

}  // namespace btms
