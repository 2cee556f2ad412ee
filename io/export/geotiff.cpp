#include "io/export/geotiff.h"

#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "engine/error.h"
#include "io/export/geo_keys.h"

namespace btms {
namespace {

enum GeoTag : std::uint32_t {
  kPixelScale = 33550,
  kTiepoint = 33922,
  kKeyDirectory = 34735,
  kKeyText = 34737,
  kGdalMetadata = 42112,
  kGdalNodata = 42113,
};

// libtiff knows these tags by what is said of them here: any count, copied.
void teach_tags(TIFF* tiff) {
  static const TIFFFieldInfo tags[] = {
      {kPixelScale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelPixelScale")},
      {kTiepoint, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelTiepoint")},
      {kKeyDirectory, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, const_cast<char*>("GeoKeyDirectory")},
      {kKeyText, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GeoAsciiParams")},
      {kGdalMetadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALMetadata")},
      {kGdalNodata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALNoData")},
  };
  TIFFMergeFieldInfo(tiff, tags, std::size(tags));
}

// Where libtiff writes. It reads nothing of what it wrote.
class Target {
 public:
  virtual ~Target() = default;
  virtual void write(std::uint64_t offset, std::span<const std::uint8_t> bytes) = 0;

  std::uint64_t at = 0, size = 0;
  std::string error;  // the first that there was
};

class MemoryTarget final : public Target {
 public:
  void write(std::uint64_t offset, std::span<const std::uint8_t> from) override {
    bytes.resize(std::max<std::size_t>(bytes.size(), offset + from.size()));
    std::memcpy(bytes.data() + offset, from.data(), from.size());
  }
  std::vector<std::uint8_t> bytes;
};

class FileTarget final : public Target {
 public:
  explicit FileTarget(const std::filesystem::path& path) : file(path) {}
  void write(std::uint64_t offset, std::span<const std::uint8_t> from) override { file.write(offset, from); }
  AtomicFile file;
};

tmsize_t read_nothing(thandle_t, void*, tmsize_t) { return 0; }
// No exception may pass through the library.
tmsize_t write_some(thandle_t handle, void* from, tmsize_t n) {
  Target& target = *static_cast<Target*>(handle);
  try {
    target.write(target.at, {static_cast<const std::uint8_t*>(from), static_cast<std::size_t>(n)});
  } catch (const std::exception& e) {
    if (target.error.empty()) target.error = e.what();
    return -1;
  }
  target.at += static_cast<std::uint64_t>(n);
  target.size = std::max(target.size, target.at);
  return n;
}
toff_t seek(thandle_t handle, toff_t offset, int whence) {
  Target& target = *static_cast<Target*>(handle);
  target.at = whence == SEEK_SET ? offset : (whence == SEEK_CUR ? target.at : target.size) + offset;
  return target.at;
}
int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<Target*>(handle)->size; }

int note_error(TIFF*, void* to, const char*, const char* format, va_list arguments) {
  std::string& error = static_cast<Target*>(to)->error;
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  if (error.empty()) error = text;
  return 1;
}
int ignore_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Close {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Handle = std::unique_ptr<TIFF, Close>;

[[noreturn]] void fail(const Target& target) {
  throw Error(ErrorCode::kFailed, "the GeoTIFF could not be written: " + target.error);
}

Handle open(Target& target, bool big) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, note_error, &target);
  TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, nullptr);
  Handle tiff(TIFFClientOpenExt("window", big ? "w8l" : "wl", &target, read_nothing, write_some, seek, close_nothing,
                                size_of, nullptr, nullptr, options));
  TIFFOpenOptionsFree(options);
  if (!tiff) fail(target);
  return tiff;
}

// Names and units of the bands, in the form that GDAL keeps them.
std::string band_texts(const std::vector<const RasterLayer*>& layers) {
  std::string text = "<GDALMetadata><Item name=\"AREA_OR_POINT\">Area</Item>";
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const auto item = [&](const char* name, const char* role, std::string_view value) {
      text.append("<Item name=\"").append(name).append("\" sample=\"").append(std::to_string(l));
      text.append("\" role=\"").append(role).append("\">").append(value).append("</Item>");
    };
    item("DESCRIPTION", "description", layers[l]->name);
    if (layers[l]->units) item("UNITTYPE", "unittype", layers[l]->units);
  }
  return text + "</GDALMetadata>";
}

// Edges of tiles are multiples of 16.
std::size_t tile_edge(const Window& whole) {
  return std::min<std::size_t>(GeoTiffFile::kTileEdge, (std::max(whole.rows, whole.cols) + 15) / 16 * 16);
}

void set(TIFF* tiff, const Target& target, std::uint32_t tag, auto... values) {
  if (TIFFSetField(tiff, tag, values...) != 1) fail(target);
}

void describe(TIFF* tiff, const Target& target, const Window& whole, const std::string& crs_wkt) {
  teach_tags(tiff);
  const auto put = [&](std::uint32_t tag, auto... values) { set(tiff, target, tag, values...); };
  put(TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(whole.cols));
  put(TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(whole.rows));
  put(TIFFTAG_BITSPERSAMPLE, 32);
  put(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  put(TIFFTAG_SAMPLESPERPIXEL, static_cast<int>(whole.layers.size()));
  put(TIFFTAG_PLANARCONFIG, PLANARCONFIG_SEPARATE);
  put(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const std::vector<std::uint16_t> unspecified(whole.layers.size() - 1, EXTRASAMPLE_UNSPECIFIED);
  if (!unspecified.empty()) put(TIFFTAG_EXTRASAMPLES, static_cast<int>(unspecified.size()), unspecified.data());
  put(TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  put(TIFFTAG_PREDICTOR, PREDICTOR_FLOATINGPOINT);
  put(TIFFTAG_TILEWIDTH, static_cast<std::uint32_t>(tile_edge(whole)));
  put(TIFFTAG_TILELENGTH, static_cast<std::uint32_t>(tile_edge(whole)));

  const GeoKeys keys = geo_keys(crs_wkt);
  const double cell = whole.cell_m / keys.unit_m;
  const double scale[] = {cell, cell, 0};
  const double north_west[] = {0, 0, 0, whole.min_x_m / keys.unit_m, whole.max_y_m() / keys.unit_m, 0};
  put(kPixelScale, 3, scale);
  put(kTiepoint, 6, north_west);
  if (!keys.directory.empty()) put(kKeyDirectory, static_cast<int>(keys.directory.size()), keys.directory.data());
  if (!keys.text.empty()) put(kKeyText, keys.text.c_str());
  put(kGdalNodata, "nan");
  const std::string texts = band_texts(whole.layers);
  put(kGdalMetadata, texts.c_str());
}

void put_part(TIFF* tiff, const Target& target, std::size_t first_row, std::size_t first_col, std::size_t edge,
              const Window& part) {
  std::vector<float> tile(edge * edge);
  for (std::size_t layer = 0; layer < part.values.size(); ++layer)
    for (std::size_t row0 = 0; row0 < part.rows; row0 += edge)
      for (std::size_t col0 = 0; col0 < part.cols; col0 += edge) {
        const std::size_t n = std::min(edge, part.cols - col0);
        std::fill(tile.begin(), tile.end(), std::numeric_limits<float>::quiet_NaN());
        for (std::size_t row = row0; row < std::min(row0 + edge, part.rows); ++row)
          std::copy_n(part.values[layer].begin() + static_cast<std::ptrdiff_t>(row * part.cols + col0), n,
                      tile.begin() + static_cast<std::ptrdiff_t>((row - row0) * edge));
        if (TIFFWriteTile(tiff, tile.data(), static_cast<std::uint32_t>(first_col + col0),
                          static_cast<std::uint32_t>(first_row + row0), 0, static_cast<std::uint16_t>(layer)) < 0)
          fail(target);
      }
}

void finish(Handle& tiff, const Target& target) {
  if (TIFFWriteDirectory(tiff.get()) != 1) fail(target);
  tiff.reset();
  if (!target.error.empty()) fail(target);
}

}  // namespace

std::vector<std::uint8_t> geotiff(const Window& window, const std::string& crs_wkt) {
  MemoryTarget target;
  Handle tiff = open(target, false);  // windows are bounded far below 4 GiB
  describe(tiff.get(), target, window, crs_wkt);
  put_part(tiff.get(), target, 0, 0, tile_edge(window), window);
  finish(tiff, target);
  return std::move(target.bytes);
}

struct GeoTiffFile::State {
  State(const std::filesystem::path& path, std::size_t tile) : target(path), edge(tile) {}
  FileTarget target;
  Handle tiff;
  std::size_t edge;
};

GeoTiffFile::GeoTiffFile(const std::filesystem::path& path, const Window& outline, const std::string& crs_wkt)
    : state_(std::make_unique<State>(path, tile_edge(outline))) {
  constexpr double kMostClassic_bytes = 3.5e9;
  const double bytes = 4.0 * static_cast<double>(outline.rows) * static_cast<double>(outline.cols) *
                       static_cast<double>(outline.layers.size());
  state_->tiff = open(state_->target, bytes > kMostClassic_bytes);
  describe(state_->tiff.get(), state_->target, outline, crs_wkt);
}
GeoTiffFile::~GeoTiffFile() = default;

void GeoTiffFile::put(std::size_t row0, std::size_t col0, const Window& part) {
  put_part(state_->tiff.get(), state_->target, row0, col0, state_->edge, part);
}

void GeoTiffFile::commit() {
  finish(state_->tiff, state_->target);
  state_->target.file.commit();
}

}  // namespace btms
