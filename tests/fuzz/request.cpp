// Requests to the tile service: any text as a request, to a map of one tile.
#include <string>
#include <string_view>

#include "apps/server/problem.h"
#include "apps/server/service.h"
#include "io/store/map_store.h"
#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {
namespace {

// 8 x 8 squares of ground that rises to the north, one of them an obstacle.
void write_map(const std::filesystem::path& path) {
  const MapLayout layout{Lattice(2000), {8, {}}};
  TerrainTile tile(2000, {0, 0, 8, 8});
  for (std::int32_t row = 0; row <= 8; ++row)
    for (std::int32_t col = 0; col <= 8; ++col) {
      tile.corner_mm[tile.corner_index({col, row})] = 100 * row;
      if (row == 8 || col == 8) continue;
      tile.centre_mm[tile.cell_index({col, row})] = 100 * row + 50;
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        NodeSurface& node = tile.nodes[tile.node_index({{col, row}, t})];
        const bool blocked = row == 3 && col == 4;
        node.cost = blocked ? kNotTraversable : 20;
        node.state = blocked ? NodeState::kObstacle : NodeState::kObserved;
      }
    }
  MapInfo info;
  info.digest = digest(tile);
  const auto writer = MapWriter::create(path, layout);
  writer->put({0, 0}, std::move(tile));
  writer->publish(info, {writer->finish()});
}

const Service& service() {
  static const Service served = [] {
    const std::filesystem::path path = folder() / "m.btms";
    std::filesystem::remove_all(path);
    write_map(path);
    ServiceOptions options;
    options.maps = {path};
    options.cache_bytes = 32 << 20;
    // What one input may ask for stays small, so that inputs are tried fast.
    options.limits.points = 500;
    options.limits.ids = 500;
    options.limits.bundle = 8;
    options.limits.route_nodes = 500;
    options.limits.window_values = 1 << 16;
    return Service(std::move(options));
  }();
  return served;
}

}  // namespace

// A line "METHOD TARGET", lines "name: value", an empty line, the body.
void request(Bytes bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto line = [&] {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view out = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return out;
  };
  Request made;
  const std::string_view first = line();
  const std::size_t gap = std::min(first.find(' '), first.size());
  made.method = first.substr(0, gap);
  try {
    parse_target(first.substr(std::min(gap + 1, first.size())), made);
  } catch (const Problem& problem) {
    require(problem.status() == 400, "a target is refused as malformed");
    return;
  }
  for (std::string_view header = line(); !header.empty(); header = line()) {
    const std::size_t colon = header.find(": ");
    if (colon != header.npos) made.headers[std::string(header.substr(0, colon))] = header.substr(colon + 2);
  }
  made.body = text;

  const auto at_once = service().answer_at_once(made);
  const Response response = service().answer(made);
  require(response.status >= 200 && response.status < 600, "an answer has a status");
  require(response.status != 500, "no request of a whole map fails");
  require(response.status < 400 || response.content_type == "application/problem+json", "a refusal says why");
  for (const auto& [name, value] : response.headers)
    require(value.find_first_of("\r\n") == value.npos, "no header ends before its end");
  if (at_once) require(at_once->status == response.status, "asked twice, answered alike");
}

}  // namespace btms::fuzz
