// btms export: a map, or a part of it, as files that other programs read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/btms/command.h"
#include "apps/btms/number_range.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/report.h"
#include "engine/error.h"
#include "engine/query/tile_cache.h"
#include "engine/routing/route.h"
#include "io/crs/crs.h"
#include "io/export/cloud_geotiff.h"
#include "io/export/geotiff.h"
#include "io/export/glb_mesh.h"
#include "io/export/graph_files.h"
#include "io/export/map_raster.h"
#include "io/export/occupancy.h"
#include "io/export/pcd_tiles.h"
#include "io/export/ply_mesh.h"
#include "io/export/window_formats.h"
#include "io/files/atomic_file.h"
#include "io/store/raster_nc.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct ExportCommand {
  CommonOptions common;
  std::string map, output;
  std::vector<std::string> layers = {"elevation"};
  std::vector<double> box_m;
  std::optional<double> cell_m;
  int level = 0;
  double inflation_m = 0;
  double tile_m = 20;
  std::string mode = "trinary";
  bool cloud = false, force = false, untrusted = false;
};

constexpr std::size_t kPartCols = 16 * GeoTiffFile::kTileEdge;

std::vector<const RasterLayer*> layers_of(const std::vector<std::string>& names) {
  std::vector<const RasterLayer*> layers;
  for (const std::string& name : names) {
    const RasterLayer* layer = find_raster_layer(name);
    if (!layer) {
      std::string known;
      for (const RasterLayer& l : raster_layers()) known.append(" ").append(l.name);
      throw Error(ErrorCode::kUsage, "no layer '" + name + "'; there are:" + known);
    }
    if (std::find(layers.begin(), layers.end(), layer) != layers.end())
      throw Error(ErrorCode::kUsage, "layer " + name + " is named twice");
    layers.push_back(layer);
  }
  return layers;
}

// What is to be read.
struct Source {
  const std::shared_ptr<const MapReader> map;
  const TileCache tiles;
  RasterFrame frame;
  std::vector<const RasterLayer*> layers;

  Window whole() const { return read_part(*map, tiles, frame, 0, 0, frame.rows(), frame.cols(), layers); }
};

void write_geotiff(const Source& source, const fs::path& path) {
  GeoTiffFile file(path, source.frame.outline(source.layers), source.map->info().crs_wkt);
  for (std::size_t row0 = 0; row0 < source.frame.rows(); row0 += GeoTiffFile::kTileEdge)
    for (std::size_t col0 = 0; col0 < source.frame.cols(); col0 += kPartCols)
      file.put(row0, col0,
               read_part(*source.map, source.tiles, source.frame, row0, col0,
                         std::min(GeoTiffFile::kTileEdge, source.frame.rows() - row0),
                         std::min(kPartCols, source.frame.cols() - col0), source.layers));
  file.commit();
}

// A file that is removed again, whatever happens.
struct Scratch {
  fs::path path;
  ~Scratch() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

void write_cloud(const Source& source, const fs::path& path) {
  const Scratch plain{path.string() + ".plain.tif"};
  write_geotiff(source, plain.path);
  write_cloud_geotiff(plain.path, path);
}

fs::path image_of(const fs::path& yaml) { return fs::path(yaml).replace_extension(".pgm"); }

void write_costmap(const Source& source, const ExportCommand& command) {
  const Occupancy map = occupancy_of(
      source.whole(), command.mode == "raw" ? OccupancyMode::kRaw : OccupancyMode::kTrinary, command.inflation_m);
  const fs::path image = image_of(command.output);
  write_file(image, map.pgm());
  write_file(command.output, map.yaml(image.filename().string()));
}

void write_nc(const Source& source, const fs::path& path) {
  const double edge_mm = 1000 * source.frame.cell_m;
  const std::int64_t whole_mm = std::llround(edge_mm);
  if (whole_mm % 2 != 0 || std::abs(edge_mm - static_cast<double>(whole_mm)) > 1e-6 ||
      whole_mm > std::numeric_limits<std::int32_t>::max())
    throw Error(ErrorCode::kUsage, "squares of a .nc are an even number of millimetres wide", path);
  const Window window = source.whole();
  std::vector<RasterValues> layers;
  for (std::size_t i = 0; i < window.layers.size(); ++i) layers.push_back({window.layers[i]->name, window.values[i]});
  const std::string& wkt = source.map->info().crs_wkt;
  std::optional<Crs> crs;
  if (!wkt.empty()) crs = describe_crs(wkt);
  write_file(path, encode_raster_nc(source.frame.box, static_cast<std::int32_t>(whole_mm), crs, layers));
}

// What is no raster: written, and what is to be said of it.
Json write_mesh(const Source& source, const ExportCommand& command, const std::string& extension) {
  const MeshSize size = (extension == ".ply" ? write_ply_mesh : write_glb_mesh)(
      *source.map, source.tiles, source.frame.level, source.frame.box, command.output);
  return {{"vertices", size.vertices}, {"triangles", size.triangles}};
}

Json write_graphs(const Source& source, const ExportCommand& command, const std::string& extension) {
  const TraversalGraph graph(Terrain(source.map), source.map->info().parameters);
  const GraphSize size = extension == ".graph" ? write_graph(*source.map, graph, source.frame.box, command.output)
                                               : write_graph_geojson(*source.map, graph, source.frame.box,
                                                                     RouteRules{}.cost_weight, command.output);
  return {{"nodes", size.nodes}, {"edges", size.edges}};
}

Json write_points(const Source& source, const ExportCommand& command) {
  const PcdTilesSize size = write_pcd_tiles(*source.map, source.tiles, source.frame, command.tile_m, command.output);
  return {{"files", size.files},
          {"points", size.points},
          {"origin_m", {size.origin_x_m, size.origin_y_m}},
          {"bytes", size.bytes}};
}

bool is_mesh(const std::string& extension) { return extension == ".ply" || extension == ".glb"; }
bool is_graph(const std::string& extension) { return extension == ".geojson" || extension == ".graph"; }

void write_raster(const Source& source, const ExportCommand& command, const std::string& extension) {
  if (extension == ".yaml") return write_costmap(source, command);
  if (extension == ".nc") return write_nc(source, command.output);
  if (extension == ".tif") return (command.cloud ? write_cloud : write_geotiff)(source, command.output);
  const Window window = source.whole();
  write_file(command.output, extension == ".npy"   ? npy(window)
                             : extension == ".npz" ? npz(window)
                                                   : window_png(window));
}

void check(const ExportCommand& command, const std::string& extension) {
  const std::string known[] = {".tif", ".npy", ".npz", ".png",     ".yaml", ".nc",
                               ".ply", ".glb", ".pcd", ".geojson", ".graph"};
  if (std::find(std::begin(known), std::end(known), extension) == std::end(known))
    throw Error(
        ErrorCode::kUsage,
        "what shall it be? Names end in .tif, .nc, .npy, .npz, .png, .yaml, .ply, .glb, .pcd, .geojson or .graph",
        command.output);
  if (command.cloud && extension != ".tif") throw Error(ErrorCode::kUsage, "--cog is for NAME.tif", command.output);
  if (is_mesh(extension) && command.cell_m)
    throw Error(ErrorCode::kUsage, "triangles are those of a --level, not of any edge (--res)", command.output);
  if (is_graph(extension) && (command.cell_m || command.level != 0))
    throw Error(ErrorCode::kUsage, "the graph has no --level and no --res: it is that of the map", command.output);
  if (extension == ".png" && command.layers.size() > 1)
    throw Error(ErrorCode::kUsage, "a picture shows one layer", command.output);
  std::vector<fs::path> outputs = {command.output};
  if (extension == ".yaml") outputs.push_back(image_of(command.output));
  if (extension == ".pcd") {
    outputs.push_back(pcd_metadata_of(command.output));
    refuse_existing(outputs, false);  // folders are not replaced
  }
  refuse_existing(outputs, command.force);
}

int run_export(const ExportCommand& command) {
  const std::string extension = fs::path(command.output).extension().string();
  check(command, extension);
  const auto layers = layers_of(extension == ".yaml" ? std::vector<std::string>{"cost", "class"} : command.layers);
  const std::shared_ptr<const MapReader> map = open_map(command.map, command.untrusted);
  std::optional<std::array<double, 4>> box_m;
  if (const auto& b = command.box_m; !b.empty()) box_m = {b[0], b[1], b[2], b[3]};
  const RasterFrame frame =
      command.cell_m ? square_frame(*map, *command.cell_m, box_m) : level_frame(*map, command.level, box_m);
  const Source source{map, TileCache(map), frame, layers};
  const Window outline = frame.outline(layers);
  Json facts{{"file", command.output},
             {"cell_m", outline.cell_m},
             {"bounds", {outline.min_x_m, outline.min_y_m, outline.max_x_m(), outline.max_y_m()}}};
  std::string what;
  if (is_mesh(extension)) {
    facts.update(write_mesh(source, command, extension));
    what = fmt::format("{} triangles, {} vertices", facts["triangles"].dump(), facts["vertices"].dump());
  } else if (is_graph(extension)) {
    facts.update(write_graphs(source, command, extension));
    what = fmt::format("{} nodes, {} edges", facts["nodes"].dump(), facts["edges"].dump());
  } else if (extension == ".pcd") {
    facts.update(write_points(source, command));
    what = fmt::format("{} points in {} files", facts["points"].dump(), facts["files"].dump());
  } else {
    write_raster(source, command, extension);
    Json names = Json::array();
    for (const RasterLayer* layer : layers) names.push_back(layer->name);
    facts.update({{"rows", outline.rows}, {"cols", outline.cols}, {"layers", std::move(names)}});
    what = fmt::format("{} x {} squares of {} m", outline.cols, outline.rows, outline.cell_m);
  }
  if (extension != ".pcd") {
    std::uint64_t bytes = fs::file_size(command.output);
    if (extension == ".yaml") bytes += fs::file_size(image_of(command.output));
    facts["bytes"] = bytes;
  }
  if (command.common.json)
    print_json(facts);
  else
    fmt::print("{}: {}, {:.2f} MB\n", command.output, what, facts["bytes"].get<double>() / 1e6);
  return 0;
}

constexpr const char* kExportFooter =
    "Examples:\n"
    "  btms export city.btms -o city.tif                                   heights as GeoTIFF, for QGIS and GDAL\n"
    "  btms export city.btms -o all.tif --layers elevation,slope,class --cog\n"
    "  btms export city.btms -o overview.png --level 2                     shaded relief, squares 4 times as wide\n"
    "  btms export city.btms -o map.yaml --res 0.5 --inflation 1.2         map.yaml and map.pgm for Nav2\n"
    "  btms export city.btms -o part.npz --bbox 100,50,300,250\n"
    "  btms export city.btms -o city.glb --level 1                         triangles for Blender and browsers\n"
    "  btms export city.btms -o city.nc --layers elevation,class           one NetCDF file, for xarray\n"
    "  btms export city.btms -o pointcloud_map.pcd --res 0.5               ground points in tiles, for Autoware\n"
    "  btms export city.btms -o city.graph                                 the traversability graph\n"
    "\n"
    "Values of rasters are those of `btms query` at the centres of the squares, heights of triangles those at their\n"
    "corners. Squares begin at whole multiples of their edge; a box is widened to whole squares. Arrays, NetCDF, "
    "pictures\n"
    "and Nav2 maps have at most 2^24 values, the other forms may be larger than memory.";

}  // namespace

Command add_export(CLI::App& btms) {
  auto command = std::make_shared<ExportCommand>();
  CLI::App* app =
      btms.add_subcommand("export", "Write a map as GeoTIFF, NetCDF, mesh, point tiles, graph, picture or Nav2 map");
  app->footer(kExportFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option(
         "-o,--output", command->output,
         "NAME.tif, .nc, .npy, .npz, .png; .ply, .glb: triangles; .yaml (and .pgm): Nav2; .pcd: a folder of ground "
         "points for Autoware; .geojson, .graph: the traversability graph")
      ->required()
      ->type_name("FILE");
  app->add_option("--layers", command->layers,
                  "elevation, elevation_sd, slope, class, roughness, step, clearance, cost, upper_elevation")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("NAMES");
  app->add_option("--bbox", command->box_m, "Part of the map, in metres of its frame")
      ->delimiter(',')
      ->expected(4)
      ->type_name("X0,Y0,X1,Y1");
  CLI::Option* level = app->add_option("--level", command->level, "Squares of 2^N squares of the map")
                           ->check(number_range(0, kMaxLevel))
                           ->capture_default_str()
                           ->type_name("N");
  app->add_option("--res", command->cell_m, "Squares of any other edge")->excludes(level)->type_name("M");
  app->add_flag("--cog", command->cloud, "Cloud Optimized GeoTIFF, with overviews; needs gdal-bin");
  app->add_option("--inflation", command->inflation_m, "Nav2: what lies so near to what can't be crossed can't either")
      ->check(number_range(0, 1000))
      ->capture_default_str()
      ->type_name("M");
  app->add_option("--tile-m", command->tile_m, "Autoware: edge of a tile, whole squares")
      ->check(number_range(0.1, 10000))
      ->capture_default_str()
      ->type_name("M");
  app->add_option("--mode", command->mode, "Nav2: trinary (free, occupied, unknown) or raw (cost 0 to 100)")
      ->check(CLI::IsMember({"trinary", "raw"}))
      ->capture_default_str();
  add_force_option(*app, command->force);
  add_untrusted_option(*app, command->untrusted);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_export(*command); }};
}

}  // namespace btms
