// Windows of their own: submaps, costmaps.
#include <cmath>

#include "apps/server/formats.h"
#include "apps/server/handlers.h"
#include "io/export/occupancy.h"

namespace btms {
namespace {

struct Frame {
  double min_x_m, min_y_m, cell_m;
  std::size_t rows, cols;
};

// Whole squares that cover the box; the resolution of the map where none is asked for.
Frame frame_of(const Call& call, const std::array<double, 4>& box) {
  const double cell_m = optional_number(call, "res").value_or(call.revision->terrain.layout().lattice.resolution_m());
  if (!(cell_m >= 1e-3)) throw Problem("bad_parameter", "expected metres, at least 0.001", "res");
  const double cols = std::ceil((box[2] - box[0]) / cell_m - 1e-9), rows = std::ceil((box[3] - box[1]) / cell_m - 1e-9);
  if (!(cols >= 1 && rows >= 1)) throw Problem("bad_parameter", "the window is empty");
  const std::size_t most = call.limits().window_values;
  if (!(cols * rows <= static_cast<double>(most)))
    throw Problem("too_much", "the window has more than " + std::to_string(most) + " squares");
  return {box[0], box[1], cell_m, static_cast<std::size_t>(rows), static_cast<std::size_t>(cols)};
}

Window window_of(const Call& call, const Frame& f, std::span<const RasterLayer* const> layers) {
  if (static_cast<double>(f.rows * f.cols) * static_cast<double>(layers.size()) >
      static_cast<double>(call.limits().window_values))
    throw Problem("too_much", "the window has too many values");
  return sample_window(call.revision->terrain.tiles(), f.min_x_m, f.min_y_m, f.cell_m, f.rows, f.cols, layers);
}

Response answer(const char* type, std::vector<std::uint8_t> bytes) {
  Response response;
  response.content_type = type;
  response.body = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return response;
}

Occupancy costmap(const Call& call) {
  const std::string mode = parameter(call, "mode", "trinary");
  if (mode != "trinary" && mode != "raw") throw Problem("bad_parameter", "", "mode", {"trinary", "raw"});
  const double inflation_m = optional_number(call, "inflation").value_or(0);
  if (!(inflation_m >= 0)) throw Problem("bad_parameter", "expected metres, not below zero", "inflation");
  const RasterLayer* layers[] = {find_raster_layer("cost"), find_raster_layer("class")};
  const Frame frame = frame_of(call, box_of(parameter(call, "bbox", ""), "bbox"));
  return occupancy_of(window_of(call, frame, layers), mode == "raw" ? OccupancyMode::kRaw : OccupancyMode::kTrinary,
                      inflation_m);
}

std::string costmap_form(const Call& call) {
  std::string form = parameter(call, "f", "pgm");
  if (form != "pgm" && form != "png") throw Problem("bad_parameter", "", "f", {"pgm", "png"});
  return form;
}

}  // namespace

Response get_submap(const Call& call) {
  const double cx = number_parameter(call, "cx"), cy = number_parameter(call, "cy"), lx = number_parameter(call, "lx"),
               ly = number_parameter(call, "ly");
  if (!(lx > 0 && ly > 0)) throw Problem("bad_parameter", "expected lengths above zero", "lx");
  const WindowFormat& format = submap_format(parameter(call, "f", "npz"));
  const auto layers = layers_of(parameter(call, "layers", "elevation"));
  const Frame frame = frame_of(call, {cx - lx / 2, cy - ly / 2, cx + lx / 2, cy + ly / 2});
  return answer(format.type, format.encode(window_of(call, frame, layers), {}, *call.revision));
}

Response get_costmap(const Call& call) {
  const std::string form = costmap_form(call);
  const Occupancy map = costmap(call);
  return form == "png" ? answer("image/png", map.png()) : answer("image/x-portable-graymap", map.pgm());
}

Response get_costmap_yaml(const Call& call) {
  const std::string form = costmap_form(call);
  const std::string yaml = costmap(call).yaml("costmap." + form);
  return answer("application/yaml", {yaml.begin(), yaml.end()});
}

}  // namespace btms
