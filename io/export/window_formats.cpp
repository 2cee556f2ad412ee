#include "io/export/window_formats.h"

#include <isa-l/crc.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/export/layer_colours.h"
#include "io/export/png.h"
#include "io/export/shading.h"

namespace btms {
namespace {

using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

template <class T>
void append(Bytes& to, const T* from, std::size_t n) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(from);
  to.insert(to.end(), bytes, bytes + n * sizeof(T));
}

// The header of a NumPy array; its length makes the values begin at a multiple of 64.
Bytes npy_header(const char* type, const std::string& shape) {
  std::string text = std::string("{'descr': '") + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr std::size_t kBefore_bytes = 10;
  text.append(63 - (kBefore_bytes + text.size()) % 64, ' ').push_back('\n');
  Bytes out{0x93,
            'N',
            'U',
            'M',
            'P',
            'Y',
            1,
            0,
            static_cast<std::uint8_t>(text.size() & 255),
            static_cast<std::uint8_t>(text.size() >> 8)};
  append(out, text.data(), text.size());
  return out;
}

// A zip archive of stored files, which is what npz is.
class Zip {
 public:
  void add(const std::string& name, const Bytes& content) {
    const std::uint32_t crc = crc32_gzip_refl(0, content.data(), content.size());
    const Bytes entry = fields(name, content.size(), crc);
    const auto offset = static_cast<std::uint32_t>(bytes_.size());
    put(bytes_, 0x04034b50);
    append(bytes_, entry.data(), entry.size());
    append(bytes_, name.data(), name.size());
    append(bytes_, content.data(), content.size());
    put(directory_, 0x02014b50);
    put16(directory_, 20);  // made by version 2.0
    append(directory_, entry.data(), entry.size());
    put16(directory_, 0);  // comment
    put16(directory_, 0);  // disk
    put16(directory_, 0);
    put(directory_, 0);  // attributes
    put(directory_, offset);
    append(directory_, name.data(), name.size());
    ++files_;
  }
  Bytes finish() {
    const auto begin = static_cast<std::uint32_t>(bytes_.size());
    append(bytes_, directory_.data(), directory_.size());
    put(bytes_, 0x06054b50);
    put(bytes_, 0);  // disks
    put16(bytes_, files_);
    put16(bytes_, files_);
    put(bytes_, static_cast<std::uint32_t>(directory_.size()));
    put(bytes_, begin);
    put16(bytes_, 0);
    return std::move(bytes_);
  }

 private:
  static void put(Bytes& to, std::uint32_t v) { append(to, &v, 1); }
  static void put16(Bytes& to, std::uint16_t v) { append(to, &v, 1); }
  static Bytes fields(const std::string& name, std::size_t size, std::uint32_t crc) {
    Bytes out;
    put16(out, 20);  // needs version 2.0
    put16(out, 0);
    put16(out, 0);       // stored
    put16(out, 0);       // time
    put16(out, 0x0021);  // 1 January 1980
    put(out, crc);
    put(out, static_cast<std::uint32_t>(size));
    put(out, static_cast<std::uint32_t>(size));
    put16(out, static_cast<std::uint16_t>(name.size()));
    put16(out, 0);
    return out;
  }
  Bytes bytes_, directory_;
  std::uint16_t files_ = 0;
};

Json value(float v) { return std::isnan(v) ? Json() : Json(static_cast<double>(v)); }

Json raster_json(const Window& window, const std::vector<float>& values) {
  Json rows = Json::array();
  for (std::size_t row = 0; row < window.rows; ++row) {
    Json line = Json::array();
    for (std::size_t col = 0; col < window.cols; ++col) line.push_back(value(values[row * window.cols + col]));
    rows.push_back(std::move(line));
  }
  return rows;
}

// Where a value is on the ramp, 0 harmless to 1.
struct Range {
  std::string_view layer;
  double low, high;
};
constexpr Range kRanges[] = {{"slope", 0, 30},    {"step", 0, 0.5}, {"roughness", 0, 0.2},
                             {"clearance", 6, 0}, {"cost", 0, 1},   {"elevation_sd", 0, 1}};
constexpr Rgb kNone{255, 255, 255};

Rgb relief_colour(const Window& window, const std::vector<float>& heights, std::size_t row, std::size_t col) {
  const auto z = [&](std::size_t r, std::size_t c) { return static_cast<double>(heights[r * window.cols + c]); };
  // Towards where a neighbour is known.
  const auto rise = [&](double back, double here, double ahead) {
    if (!std::isnan(back) && !std::isnan(ahead)) return (ahead - back) / 2;
    return !std::isnan(ahead) ? ahead - here : !std::isnan(back) ? here - back : 0.0;
  };
  const double here = z(row, col), none = std::nan("");
  const double east = rise(col > 0 ? z(row, col - 1) : none, here, col + 1 < window.cols ? z(row, col + 1) : none);
  const double north = rise(row + 1 < window.rows ? z(row + 1, col) : none, here, row > 0 ? z(row - 1, col) : none);
  return shaded(state_colour(NodeState::kObserved), {east / window.cell_m, north / window.cell_m}, 3);
}

}  // namespace

Bytes npy(const Window& window) {
  Bytes out = npy_header("<f4", std::to_string(window.values.size()) + ", " + std::to_string(window.rows) + ", " +
                                    std::to_string(window.cols));
  for (const std::vector<float>& layer : window.values) append(out, layer.data(), layer.size());
  return out;
}

Bytes npz(const Window& window) {
  Zip zip;
  for (std::size_t l = 0; l < window.layers.size(); ++l) {
    Bytes array = npy_header("<f4", std::to_string(window.rows) + ", " + std::to_string(window.cols));
    append(array, window.values[l].data(), window.values[l].size());
    zip.add(std::string(window.layers[l]->name) + ".npy", array);
  }
  const auto centres = [&](const char* name, std::size_t n, double first, double step) {
    Bytes array = npy_header("<f8", std::to_string(n) + ",");
    for (std::size_t i = 0; i < n; ++i) {
      const double at = first + step * static_cast<double>(i);
      append(array, &at, 1);
    }
    zip.add(std::string(name) + ".npy", array);
  };
  centres("x", window.cols, window.min_x_m + window.cell_m / 2, window.cell_m);
  centres("y", window.rows, window.max_y_m() - window.cell_m / 2, -window.cell_m);
  return zip.finish();
}

std::string window_json(const Window& window) {
  Json layers = Json::object();
  for (std::size_t l = 0; l < window.layers.size(); ++l)
    layers[std::string(window.layers[l]->name)] = raster_json(window, window.values[l]);
  return Json{{"level", window.level >= 0 ? Json(window.level) : Json()},
              {"rows", window.rows},
              {"cols", window.cols},
              {"cell_m", window.cell_m},
              {"min", {window.min_x_m, window.min_y_m}},
              {"layers", std::move(layers)}}
      .dump();
}

std::string gridmap_json(const Window& window, const std::string& frame) {
  // grid_map's rows run along -x and its columns along -y; column-major, so -x is what runs fastest.
  Json names = Json::array(), data = Json::array();
  for (std::size_t l = 0; l < window.layers.size(); ++l) {
    names.push_back(window.layers[l]->name);
    Json values = Json::array();
    for (std::size_t row = 0; row < window.rows; ++row)
      for (std::size_t col = window.cols; col-- > 0;)
        values.push_back(value(window.values[l][row * window.cols + col]));
    data.push_back({{"layout",
                     {{"dim",
                       {{{"label", "column_index"}, {"size", window.rows}, {"stride", window.rows * window.cols}},
                        {{"label", "row_index"}, {"size", window.cols}, {"stride", window.cols}}}},
                      {"data_offset", 0}}},
                    {"data", std::move(values)}});
  }
  const double x = (window.min_x_m + window.max_x_m()) / 2, y = (window.min_y_m + window.max_y_m()) / 2;
  return Json{
      {"info",
       {{"header", {{"frame_id", frame}}},
        {"resolution", window.cell_m},
        {"length_x", static_cast<double>(window.cols) * window.cell_m},
        {"length_y", static_cast<double>(window.rows) * window.cell_m},
        {"pose",
         {{"position", {{"x", x}, {"y", y}, {"z", 0}}}, {"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}}}}},
      {"layers", std::move(names)},
      {"basic_layers", Json::array()},
      {"data", std::move(data)},
      {"outer_start_index", 0},
      {"inner_start_index", 0}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

Bytes window_png(const Window& window) {
  const std::vector<float>& values = window.values[0];
  const std::string_view name = window.layers[0]->name;
  const auto range =
      std::find_if(std::begin(kRanges), std::end(kRanges), [&](const Range& r) { return r.layer == name; });
  std::vector<Rgb> pixels(values.size(), kNone);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    if (name == "class")
      pixels[i] = state_colour(static_cast<NodeState>(static_cast<std::uint8_t>(values[i])));
    else if (range != std::end(kRanges))
      pixels[i] = ramp_colour((static_cast<double>(values[i]) - range->low) / (range->high - range->low));
    else
      pixels[i] = relief_colour(window, values, i / window.cols, i % window.cols);
  }
  return png_of(static_cast<std::uint32_t>(window.cols), static_cast<std::uint32_t>(window.rows), pixels);
}

}  // namespace btms
