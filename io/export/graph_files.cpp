#include "io/export/graph_files.h"

#include <fmt/format.h>

#include "engine/error.h"
#include "io/files/file_section.h"
#include "io/crs/crs.h"

namespace btms {
namespace {

// fn(tile's graph, node's id, node) of all of them, tiles ascending, rows from the south.
template <class Fn>
void for_each_node(const TraversalGraph& graph, const CellBox& box, const Fn& fn) {
  for (const TileId id : graph.terrain().tiles().tiles()) {
    if (graph.layout().grid.box_of(id).intersect(box).empty()) continue;
    const std::shared_ptr<const TileGraph> tile = graph.tile(id);
    if (!tile) continue;
    const CellBox own = tile->box().intersect(box);
    for (std::int32_t row = own.row0; row < own.row1; ++row)
      for (std::int32_t col = own.col0; col < own.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t)
          if (const NodeId node{{col, row}, t}; const GraphNode* found = tile->find(node)) fn(*tile, node, *found);
  }
}

// The edges of a node whose other end is in the box, too.
std::uint16_t edges_inside(NodeId id, const GraphNode& node, const CellBox& box) {
  std::uint16_t edges = 0;
  for (std::size_t n = 0; n < kNeighbours; ++n) {
    const NodeOffset& o = kNeighbourTable[id.triangle][n];
    if ((node.edges >> n & 1) != 0 && box.contains({id.cell.col + o.col, id.cell.row + o.row}))
      edges |= static_cast<std::uint16_t>(1 << n);
  }
  return edges;
}

std::string place(const Centroid& c) {
  const auto m = [](std::int64_t thirds) { return static_cast<double>(thirds) / 3000; };
  return fmt::format("[{:.4f},{:.4f},{:.4f}]", m(c.x3), m(c.y3), m(c.z3));
}

void expect_some(const GraphSize& size) {
  if (size.nodes == 0) throw Error(ErrorCode::kUsage, "there is nothing in the box that the vehicle can cross");
}

}  // namespace

GraphSize write_graph_geojson(const MapReader& map, const TraversalGraph& graph, const CellBox& box, double cost_weight,
                              const std::filesystem::path& path) {
  const std::string& wkt = map.info().crs_wkt;
  const int epsg = wkt.empty() ? 0 : describe_crs(wkt).epsg;
  const Lattice& lattice = graph.layout().lattice;
  GraphSize size;
  AtomicFile file(path);
  FileSection out(file, 0);
  out.put(std::string_view("{\"type\":\"FeatureCollection\","));
  if (epsg != 0)
    out.put(
        fmt::format("\"crs\":{{\"type\":\"name\",\"properties\":{{\"name\":\"urn:ogc:def:crs:EPSG::{}\"}}}},", epsg));
  out.put(std::string_view("\"features\":["));
  for_each_node(graph, box, [&](const TileGraph& tile, NodeId id, const GraphNode& node) {
    const Centroid at = centroid_of(id, node, lattice);
    out.put(
        fmt::format("{}{{\"type\":\"Feature\",\"id\":\"{}\",\"properties\":{{\"cost\":{:.4f}}},\"geometry\":"
                    "{{\"type\":\"Point\",\"coordinates\":{}}}}}",
                    size.nodes == 0 ? "\n" : ",\n", node_key(id), node.cost / 254.0, place(at)));
    ++size.nodes;
    tile.for_each_edge(id, cost_weight, [&](NodeId to, const GraphNode& other, double weight) {
      if (node_key(to) < node_key(id) || !box.contains(to.cell)) return;
      out.put(
          fmt::format(",\n{{\"type\":\"Feature\",\"properties\":{{\"from\":\"{}\",\"to\":\"{}\",\"weight\":{:.4f}}},"
                      "\"geometry\":{{\"type\":\"LineString\",\"coordinates\":[{},{}]}}}}",
                      node_key(id), node_key(to), weight, place(at), place(centroid_of(to, other, lattice))));
      ++size.edges;
    });
  });
  expect_some(size);
  out.put(std::string_view("\n]}\n"));
  out.flush();
  file.commit();
  return size;
}

GraphSize write_graph(const MapReader& map, const TraversalGraph& graph, const CellBox& box,
                      const std::filesystem::path& path) {
  constexpr std::uint64_t kHead_bytes = 64, kNode_bytes = 16, kTable_bytes = kTriangles * 16 * 3;
  const Lattice& lattice = graph.layout().lattice;
  const std::string& wkt = map.info().crs_wkt;
  GraphSize size;
  AtomicFile file(path);
  FileSection nodes(file, kHead_bytes + kTable_bytes);
  for_each_node(graph, box, [&](const TileGraph&, NodeId id, const GraphNode& node) {
    const std::uint16_t edges = edges_inside(id, node, box);
    nodes.put(id.cell.col, id.cell.row, static_cast<std::int32_t>(centroid_of(id, node, lattice).z3), edges,
              id.triangle, node.cost);
    ++size.nodes;
    size.edges += static_cast<std::uint64_t>(__builtin_popcount(edges));
  });
  size.edges /= 2;
  expect_some(size);
  nodes.put(wkt);
  nodes.flush();
  FileSection head(file, 0);
  head.put(std::string_view("BTMSGRPH"));
  head.put(std::uint32_t{1}, lattice.resolution_mm(), size.nodes, size.edges, map.info().revision,
           static_cast<std::uint64_t>(wkt.size()), std::uint64_t{0}, static_cast<std::uint32_t>(kNode_bytes),
           static_cast<std::uint32_t>(kHead_bytes + kTable_bytes));
  for (const auto& row : kNeighbourTable)
    for (std::size_t n = 0; n < 16; ++n) {
      const NodeOffset o = n < row.size() ? row[n] : NodeOffset{};
      head.put(o.col, o.row, o.triangle);
    }
  head.flush();
  file.commit();
  return size;
}

}  // namespace btms
