// Point files: one table from extension to reader, one to label writer.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/terrain/segmentation.h"
#include "engine/tiling/point_source.h"
#include "io/points/input_file.h"

namespace btms {

struct PointFileInfo {
  std::string format;  // "LAS 1.2, point format 3", "KITTI scan", "PCD 0.7 binary"
  std::uint64_t points = 0;
  std::uint64_t bytes = 0;
  std::uint64_t label_bytes = 0;  // of a copy with labels, where that isn't as long as the file
  std::optional<std::array<double, 6>> declared_bounds_m;  // min x, y, z, max x, y, z as the header says: only a hint
  std::string crs;                                         // of the points, WKT or "EPSG:n", or empty
  std::vector<std::string> warnings;                       // what was odd but acceptable, one sentence each
};

// An open point file. Reads with pread, so concurrent reads are safe and a file truncated meanwhile is an Error, never
// a signal. Dropped points keep their place.
class PointFile : public PointSource {
 public:
  std::string name() const final { return path().string(); }
  std::uint64_t size() const final { return info_.points; }
  const std::filesystem::path& path() const { return file_.path(); }
  const PointFileInfo& info() const { return info_; }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const final;

 protected:
  explicit PointFile(const std::filesystem::path& path) : file_(path) { info_.bytes = file_.size(); }

  const InputFile file_;
  PointFileInfo info_;  // for a reader's constructor to fill in

 private:
  // Fills the block, which has room for `count` points. Precondition: they are in the file.
  virtual void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const = 0;
};

struct PointFileOptions {
  std::string crs;      // where points come out when the file names another system; empty: in the file's own
  std::string columns;  // of text: "2,3,4" where x, y and z are, or "id,x,y,z" what is where; empty: see xyz.h
};

// Opens by extension (.las .laz .bin .pcd .ply .npy, text: .xyz .csv .txt .asc). Everything that can be checked without
// reading the points is checked here. Throws Error(kBadInput) naming file, offset, what was found and what was
// expected; Error(kUsage) for an extension that no reader knows, listing those that are known. Opening never blocks (a
// FIFO is refused). Without options.crs, degrees and geocentric coordinates come out in their UTM zone (info().crs).
// Throws Error(kUsage) when PROJ knows no way there.
std::unique_ptr<PointFile> open_points(const std::filesystem::path& path, const PointFileOptions& options = {});

// Extensions open_points knows, with the dot.
std::vector<std::string> known_point_extensions();
// Those of them that mean points wherever they are met, as .csv and .txt don't.
std::vector<std::string> point_extensions_in_folders();

struct InputList {
  std::vector<std::filesystem::path> paths;
  std::vector<std::string> warnings;  // one sentence each
};

// Files, folders (every point file in them but .csv, .txt and .asc; not recursive, sorted by name) and globs, in the
// order given. A file that is met again, by whatever name, is left out and warned of. Throws Error(kUsage) when an
// argument matches nothing.
InputList expand_inputs(std::span<const std::string> arguments);

// Receives the labels of one input and writes them in the format that belongs to it:
//   .las -> .las  a copy with only the class changed: 2 terrain, 1 obstacle, 7 far below; dropped points keep theirs
//   .laz -> .las  the same points and records, not compressed
//   .bin -> .label  u32: 40 terrain, 99 obstacle and below, 0 dropped
//   .pcd, .ply, .npy, text -> .labels u8: 1 terrain, 0 not
// write() is thread-safe for disjoint runs. Nothing is visible under the final name before commit(); without commit()
// the temporary file is removed. Throws Error(kFailed) on any failed write.
class LabelWriter {
 public:
  virtual ~LabelWriter() = default;
  virtual void write(std::uint64_t first, std::span<const Label> labels) = 0;
  // The same with the input's block of these points, read with keep_records: a writer that copies records takes them
  // from there and doesn't read them again. Changes them.
  virtual void write(std::uint64_t first, std::span<const Label> labels, PointBlock& block) = 0;
  // Flushes, fsyncs, renames into place.
  virtual void commit() = 0;
  virtual const std::filesystem::path& path() const = 0;
};

// Output name: folder / input's name with the extension above.
std::filesystem::path label_path(const std::filesystem::path& input, const std::filesystem::path& folder);

// Size of that file.
std::uint64_t label_bytes(const PointFile& input);

// Writes to label_path(). Throws Error(kUsage) when it would be the input itself.
std::unique_ptr<LabelWriter> create_labels(const PointFile& input, const std::filesystem::path& folder);

// Per-point classes for evaluation, as unsigned integers: LAS classification, KITTI .label (lower 16 bits), .labels
// bytes, the class column of text. Throws Error(kBadInput) as open_points does.
std::vector<std::uint32_t> read_classes(const std::filesystem::path& path);

}  // namespace btms
