// A map that is open: heights, layers, checks, routes.

#include <cmath>
#include <cstring>

#include "apps/python/arrays.h"
#include "engine/query/footprint.h"
#include "engine/query/profile.h"
#include "engine/routing/route.h"
#include "io/export/raster.h"
#include "io/store/manifest.h"
#include "io/store/open_terrain.h"

namespace btms::python {
namespace {

class Map {
 public:
  Map(const std::filesystem::path& folder, std::size_t cache_bytes, bool untrusted)
      : opened_(open_terrain(folder, {cache_bytes}, untrusted ? Trust::kUntrusted : Trust::kTrusted)),
        graph_(opened_.terrain, opened_.reader->info().parameters) {}

  const MapInfo& info() const { return opened_.reader->info(); }
  double resolution_m() const { return opened_.terrain.layout().lattice.resolution_m(); }

  std::vector<double> bounds() const {
    CellBox box;
    for (const ShardEntry& shard : opened_.reader->shards())
      for (const auto& tile : shard.tiles) box = box.hull(tile.box);
    const double r = resolution_m();
    return {box.col0 * r, box.row0 * r, box.col1 * r, box.row1 * r};
  }

  std::vector<HeightAnswer> answers(const py::object& xy, const py::object& hint) const {
    const std::vector<Place> places = places_of(xy, "xy");
    std::vector<double> hints;
    if (!hint.is_none()) {
      const auto z = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(hint);
      if (!z || z.size() != static_cast<py::ssize_t>(places.size()))
        throw Error(ErrorCode::kUsage, "z_hint: expected a number for every place");
      hints.assign(z.data(), z.data() + z.size());
    }
    std::vector<HeightAnswer> out(places.size());
    const py::gil_scoped_release others;
    if (hints.empty())
      opened_.terrain.heights(places, out);
    else
      opened_.terrain.heights(places, hints, out);
    for (const HeightAnswer& a : out)
      if (a.status == QueryStatus::kDamaged)
        throw Error(ErrorCode::kVerification, "a tile is damaged; `btms verify` says which and why");
    return out;
  }

  py::array_t<double> heights(const py::object& xy, const py::object& hint) const {
    const auto all = answers(xy, hint);
    py::array_t<double> out(static_cast<py::ssize_t>(all.size()));
    for (std::size_t i = 0; i < all.size(); ++i) out.mutable_data()[i] = all[i].z_m;
    return out;
  }

  py::dict query(const py::object& xy, const py::object& hint) const {
    const auto all = answers(xy, hint);
    const auto n = static_cast<py::ssize_t>(all.size());
    py::array_t<double> z(n), sd(n), cost(n), normal({n, py::ssize_t{3}});
    py::array_t<std::uint8_t> state(n), surfaces(n);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const HeightAnswer& a = all[i];
      z.mutable_data()[i] = a.z_m;
      sd.mutable_data()[i] = std::sqrt(a.variance_m2);
      cost.mutable_data()[i] = static_cast<double>(a.cost);
      state.mutable_data()[i] = static_cast<std::uint8_t>(a.state);
      surfaces.mutable_data()[i] = a.surfaces;
      std::memcpy(normal.mutable_data() + 3 * i, a.normal, sizeof a.normal);
    }
    py::dict out;
    out["z"] = z;
    out["sd"] = sd;
    out["normal"] = normal;
    out["state"] = state;
    out["cost"] = cost;
    out["surfaces"] = surfaces;
    return out;
  }

  // {name: (rows, cols) float32 from the north}, "x" and "y" of the squares' centres.
  py::dict layers(const std::vector<std::string>& names, const py::object& bbox, const py::object& resolution) const {
    std::vector<const RasterLayer*> wanted;
    std::string known;
    for (const RasterLayer& layer : raster_layers()) known += (known.empty() ? "" : ", ") + std::string(layer.name);
    for (const std::string& name : names) {
      wanted.push_back(find_raster_layer(name));
      if (!wanted.back()) throw Error(ErrorCode::kUsage, "no layer '" + name + "'; there are " + known);
    }
    const std::vector<double> box = bbox.is_none() ? bounds() : bbox.cast<std::vector<double>>();
    if (box.size() != 4 || !(box[0] < box[2]) || !(box[1] < box[3]))
      throw Error(ErrorCode::kUsage, "bbox: expected (min x, min y, max x, max y)");
    const double cell = resolution.is_none() ? resolution_m() : resolution.cast<double>();
    if (!(cell > 0)) throw Error(ErrorCode::kUsage, "resolution: expected metres above zero");
    // Squares of the map's own size lie on its own grid.
    const bool own = resolution.is_none();
    const double x0 = own ? std::floor(box[0] / cell) * cell : box[0],
                 y0 = own ? std::floor(box[1] / cell) * cell : box[1];
    const double cols = std::ceil((box[2] - x0) / cell - 1e-9), rows = std::ceil((box[3] - y0) / cell - 1e-9);
    if (!(cols * rows <= static_cast<double>(kMaxWindowSquares)))
      throw Error(ErrorCode::kUsage, "the window has more than " + std::to_string(kMaxWindowSquares) + " squares");
    Window window;
    {
      const py::gil_scoped_release others;
      window = sample_window(opened_.terrain.tiles(), x0, y0, cell, static_cast<std::size_t>(rows),
                             static_cast<std::size_t>(cols), wanted);
    }
    py::dict out;
    const auto r = static_cast<py::ssize_t>(window.rows), c = static_cast<py::ssize_t>(window.cols);
    for (std::size_t l = 0; l < wanted.size(); ++l) {
      py::array_t<float> values({r, c});
      std::memcpy(values.mutable_data(), window.values[l].data(), window.values[l].size() * sizeof(float));
      out[py::str(names[l])] = values;
    }
    py::array_t<double> x(c), y(r);
    for (py::ssize_t i = 0; i < c; ++i) x.mutable_data()[i] = window.min_x_m + (static_cast<double>(i) + 0.5) * cell;
    for (py::ssize_t i = 0; i < r; ++i) y.mutable_data()[i] = window.max_y_m() - (static_cast<double>(i) + 0.5) * cell;
    out["x"] = x;
    out["y"] = y;
    return out;
  }

  py::array_t<double> profile(const py::object& line, double step_m) const {
    const std::vector<Place> places = places_of(line, "line");
    std::vector<ProfilePoint> points;
    {
      const py::gil_scoped_release others;
      points = btms::profile(opened_.terrain, places, step_m);
    }
    py::array_t<double> out({static_cast<py::ssize_t>(points.size()), py::ssize_t{2}});
    for (std::size_t i = 0; i < points.size(); ++i) {
      out.mutable_data()[2 * i] = points[i].distance_m;
      out.mutable_data()[2 * i + 1] = points[i].height.z_m;
    }
    return out;
  }

  py::dict check(const py::object& path, const py::object& footprint, const py::object& radius,
                 const py::dict& limits) const {
    const Parameters& p = info().parameters;
    VehicleLimits held = limits_of(p);
    for (const auto& [key, value] : limits) {
      const std::string name = py::str(key);
      if (name == "slope_deg")
        held.slope_deg = value.cast<double>();
      else if (name == "step_m")
        held.step_m = value.cast<double>();
      else if (name == "roughness_m")
        held.roughness_m = value.cast<double>();
      else if (name == "height_m")
        held.height_m = value.cast<double>();
      else if (name == "unknown_is_safe")
        held.unknown_is_safe = value.cast<bool>();
      else
        throw Error(ErrorCode::kUsage,
                    "limits: there are slope_deg, step_m, roughness_m, height_m and unknown_is_safe");
    }
    const std::vector<Place> places = places_of(path, "path");
    const CheckAnswer a = footprint.is_none()
                              ? check_path(opened_.terrain, places,
                                           radius.is_none() ? p.vehicle_width_m / 2 : radius.cast<double>(), held)
                              : check_path(opened_.terrain, places, places_of(footprint, "footprint"), held);
    py::dict out;
    out["is_safe"] = a.safe;
    out["traversability"] = a.traversability;
    out["reason"] = a.safe ? py::object(py::none()) : py::str(hazard_name(a.hazard));
    out["at"] = a.safe ? py::object(py::none()) : py::make_tuple(a.at.x_m, a.at.y_m);
    return out;
  }

  py::dict route(const py::object& from, const py::object& to, double cost_weight, const py::object& width) const {
    RouteRules rules;
    rules.cost_weight = cost_weight;
    rules.width_m = width.is_none() ? info().parameters.vehicle_width_m : width.cast<double>();
    rules.limits = limits_of(info().parameters);
    const Place a = place_of(from, "start"), b = place_of(to, "goal");
    Route found;
    {
      const py::gil_scoped_release others;
      found = find_route(graph_, a, b, rules);
    }
    py::array_t<double> points({static_cast<py::ssize_t>(found.points.size()), py::ssize_t{3}});
    for (std::size_t i = 0; i < found.points.size(); ++i) {
      points.mutable_data()[3 * i] = found.points[i].place.x_m;
      points.mutable_data()[3 * i + 1] = found.points[i].place.y_m;
      points.mutable_data()[3 * i + 2] = found.points[i].z_m;
    }
    py::dict out;
    out["status"] = route_status_name(found.status);
    out["points"] = points;
    out["length_m"] = found.length_m;
    out["steepest_deg"] = found.steepest_deg;
    return out;
  }

 private:
  const OpenedMap opened_;
  const TraversalGraph graph_;
};

}  // namespace

void add_map(py::module_& module) {
  py::class_<Map>(module, "Map", "One revision of a map, read-only; threads may share it.")
      .def(py::init<const std::filesystem::path&, std::size_t, bool>(), py::arg("folder"),
           py::arg("cache_bytes") = std::size_t{512} << 20, py::arg("untrusted") = false,
           "Opens a map made by build() or `btms build`. `untrusted`: shards are parsed in a sandboxed process.")
      .def_property_readonly("bounds", &Map::bounds, "[min x, min y, max x, max y] of what the map holds, metres.")
      .def_property_readonly("resolution_m", &Map::resolution_m, "Edge of the finest squares.")
      .def_property_readonly(
          "crs_wkt", [](const Map& m) { return m.info().crs_wkt; }, "WKT 2, or ''.")
      .def_property_readonly(
          "digest", [](const Map& m) { return m.info().digest.hex(); },
          "Of the content: equal maps have equal digests.")
      .def_property_readonly("revision", [](const Map& m) { return m.info().revision; })
      .def_property_readonly(
          "points", [](const Map& m) { return m.info().points; }, "Points the map is made of.")
      .def_property_readonly_static("layer_names",
                                    [](const py::object&) {
                                      std::vector<std::string> names;
                                      for (const RasterLayer& layer : raster_layers()) names.emplace_back(layer.name);
                                      return names;
                                    })
      .def(
          "heights", &Map::heights, py::arg("xy"), py::arg("z_hint") = py::none(),
          "Heights (N,) at places (N, 2), NaN where there is no surface. With `z_hint` (N,) the surface nearest to it.")
      .def("query", &Map::query, py::arg("xy"), py::arg("z_hint") = py::none(),
           "Arrays by name: z, sd, normal (N, 3), state (0 unknown, 1 observed, 2 predicted, 3 obstacle, 4 filled),\n"
           "cost (0 to 1, inf: not traversable), surfaces (how many lie above each other).")
      .def("layers", &Map::layers, py::arg("names") = std::vector<std::string>{"elevation"},
           py::arg("bbox") = py::none(), py::arg("resolution") = py::none(),
           "Rasters by name, (rows, cols) float32, north first, and the centres `x`, `y` of columns and rows. The "
           "whole map\n"
           "in its own squares unless `bbox` or `resolution` (metres) say otherwise.")
      .def("profile", &Map::profile, py::arg("line"), py::arg("step_m") = 1.0,
           "(M, 2): distance and height along the line (N, 2), every step_m and at its vertices.")
      .def("check", &Map::check, py::arg("path"), py::arg("footprint") = py::none(), py::arg("radius") = py::none(),
           py::arg("limits") = py::dict(),
           "Whether a vehicle may drive along the path (N, 2): a footprint (M, 2), x ahead, y left, or a disc of a "
           "radius;\n"
           "else a disc as wide as the map's vehicle. `limits` are slope_deg, step_m, roughness_m, height_m,\n"
           "unknown_is_safe; those of the map's vehicle where not given. Gives is_safe, traversability, reason, at.")
      .def("route", &Map::route, py::arg("start"), py::arg("goal"), py::kw_only(), py::arg("cost_weight") = 4.0,
           py::arg("width_m") = py::none(),
           "The cheapest way for the map's vehicle: status, points (N, 3), length_m, steepest_deg.");
}

}  // namespace btms::python
