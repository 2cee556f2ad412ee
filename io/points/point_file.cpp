#include "io/points/point_file.h"

#include <cassert>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/points/extension.h"
#include "io/points/kitti.h"
#include "io/points/las.h"
#include "io/points/laz.h"
#include "io/points/npy.h"
#include "io/points/pcd.h"
#include "io/points/plain_labels.h"
#include "io/points/ply.h"
#include "io/points/xyz.h"

namespace btms {
namespace {

using Open = std::unique_ptr<PointFile>(const std::filesystem::path&, const PointFileOptions&);

// Of formats that have no options, of those that name a reference system, of text.
template <auto open>
std::unique_ptr<PointFile> plain(const std::filesystem::path& path, const PointFileOptions& /*options*/) {
  return open(path);
}
template <auto open>
std::unique_ptr<PointFile> placed(const std::filesystem::path& path, const PointFileOptions& options) {
  return open(path, options.crs);
}
std::unique_ptr<PointFile> text(const std::filesystem::path& path, const PointFileOptions& options) {
  return open_xyz(path, options.columns);
}

struct Format {
  const char* extension;
  Open* open;
  const char* label_extension;  // nullptr: the input's own
  std::uint64_t label_bytes;    // a point; 0: as many as the input
  std::unique_ptr<LabelWriter> (*create_labels)(const PointFile&, const std::filesystem::path&);
  bool in_folders = true;
};

constexpr Format kFormats[] = {
    {".las", placed<open_las>, nullptr, 0, create_las_labels},
    {".laz", placed<open_laz>, ".las", 0, create_laz_labels},
    {".bin", plain<open_kitti>, ".label", 4, create_kitti_labels},
    {".pcd", plain<open_pcd>, ".labels", 1, create_byte_labels},
    {".ply", plain<open_ply>, ".labels", 1, create_byte_labels},
    {".npy", plain<open_npy>, ".labels", 1, create_byte_labels},
    {".xyz", text, ".labels", 1, create_byte_labels},
    {".csv", text, ".labels", 1, create_byte_labels, false},
    {".txt", text, ".labels", 1, create_byte_labels, false},
    {".asc", text, ".labels", 1, create_byte_labels, false},
};

struct ClassFormat {
  const char* extension;
  std::vector<std::uint32_t> (*read)(const std::filesystem::path&);
};

constexpr ClassFormat kClassFormats[] = {
    {".las", read_las_classes},     {".laz", read_laz_classes}, {".label", read_kitti_classes},
    {".labels", read_byte_classes}, {".xyz", read_xyz_classes}, {".csv", read_xyz_classes},
    {".txt", read_xyz_classes},     {".asc", read_xyz_classes},
};

template <typename Row, std::size_t n>
const Row& row_for(const Row (&table)[n], const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  std::string known;
  for (const Row& row : table) {
    if (extension == row.extension) return row;
    known += std::string(known.empty() ? "" : " ") + row.extension;
  }
  throw Error(ErrorCode::kUsage, "no reader for the extension \"" + extension + "\"; expected one of " + known,
              path.string());
}

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;  // most often the output does not exist yet
  return std::filesystem::equivalent(a, b, error) && !error;
}

}  // namespace

void PointFile::read(std::uint64_t first, std::size_t count, PointBlock& block) const {
  assert(first <= size() && count <= size() - first);
  block.reset(count);
  do_read(first, count, block);
}

std::unique_ptr<PointFile> open_points(const std::filesystem::path& path, const PointFileOptions& options) {
  return row_for(kFormats, path).open(path, options);
}

std::vector<std::string> known_point_extensions() {
  std::vector<std::string> extensions;
  for (const Format& format : kFormats) extensions.emplace_back(format.extension);
  return extensions;
}

std::vector<std::string> point_extensions_in_folders() {
  std::vector<std::string> extensions;
  for (const Format& format : kFormats)
    if (format.in_folders) extensions.emplace_back(format.extension);
  return extensions;
}

std::filesystem::path label_path(const std::filesystem::path& input, const std::filesystem::path& folder) {
  const Format& format = row_for(kFormats, input);
  std::filesystem::path output = folder / input.filename();
  if (format.label_extension != nullptr) output.replace_extension(format.label_extension);
  return output;
}

std::uint64_t label_bytes(const PointFile& input) {
  const Format& format = row_for(kFormats, input.path());
  if (format.label_bytes > 0) return format.label_bytes * input.size();
  return input.info().label_bytes > 0 ? input.info().label_bytes : input.info().bytes;
}

std::unique_ptr<LabelWriter> create_labels(const PointFile& input, const std::filesystem::path& folder) {
  const Format& format = row_for(kFormats, input.path());
  const std::filesystem::path output = label_path(input.path(), folder);
  if (same_file(input.path(), output)) {
    throw Error(ErrorCode::kUsage, "labels would replace the input itself; choose another output folder",
                output.string());
  }
  make_folders(folder);
  return format.create_labels(input, output);
}

std::vector<std::uint32_t> read_classes(const std::filesystem::path& path) {
  return row_for(kClassFormats, path).read(path);
}

}  // namespace btms
