// Point files: the header, every point whole and in parts, classes, and the copy with labels.
#include <algorithm>
#include <memory>
#include <utility>

#include "engine/lattice/coordinates.h"
#include "io/points/kitti.h"
#include "io/points/las.h"
#include "io/points/las_header.h"
#include "io/points/npy.h"
#include "io/points/pcd.h"
#include "io/points/plain_labels.h"
#include "io/points/ply.h"
#include "io/points/xyz.h"
#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {
namespace {

void check_points(const PointBlock& block, std::uint64_t count) {
  require(block.x_mm.size() == count && block.y_mm.size() == count && block.z_mm.size() == count,
          "a block has as many points as asked for");
  std::size_t dropped = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (block.x_mm[i] == PointBlock::kDroppedX) {
      ++dropped;
      continue;
    }
    require(std::abs(block.x_mm[i]) <= kMaxHorizontal_mm && std::abs(block.y_mm[i]) <= kMaxHorizontal_mm &&
                std::abs(block.z_mm[i]) <= kMaxVertical_mm,
            "points that are not dropped lie within the limits");
  }
  require(dropped == block.dropped(), "the counts of dropped points are those of the block");
}

// All points at once, and again in two parts, must be the same.
PointBlock read_points(const PointFile& file) {
  const std::uint64_t n = file.size();
  require(file.info().points == n, "info and source say the same number of points");
  PointBlock all, first, second;
  all.keep_records = true;
  file.read(0, n, all);
  check_points(all, n);
  file.read(0, n / 3, first);
  file.read(n / 3, n - n / 3, second);
  require(first.dropped() + second.dropped() == all.dropped(), "parts drop what the whole drops");
  for (std::size_t i = 0; i < n; ++i) {
    const PointBlock& part = i < n / 3 ? first : second;
    const std::size_t at = i < n / 3 ? i : i - n / 3;
    require(part.x_mm[at] == all.x_mm[i], "a part reads as the whole does");
    if (all.x_mm[i] == PointBlock::kDroppedX) continue;
    require(part.y_mm[at] == all.y_mm[i] && part.z_mm[at] == all.z_mm[i], "a part reads as the whole does");
  }
  return all;
}

// Dropped points dropped, the others in turn.
std::vector<Label> some_labels(const PointBlock& block) {
  std::vector<Label> labels(block.size());
  for (std::size_t i = 0; i < labels.size(); ++i)
    labels[i] = block.x_mm[i] == PointBlock::kDroppedX ? Label::kDropped : static_cast<Label>(1 + i % 3);
  return labels;
}

std::vector<std::uint8_t> written(LabelWriter& writer, const std::vector<Label>& labels) {
  writer.write(0, labels);
  writer.commit();
  std::vector<std::uint8_t> bytes = content(writer.path());
  std::filesystem::remove(writer.path());
  return bytes;
}

void check_las_copy(Bytes input, const PointFile& file, const PointBlock& all) {
  const LasHeader header = read_las_header(InputFile(file.path()));
  const std::vector<Label> labels = some_labels(all);
  const auto copy = written(*create_las_labels(file, folder() / "copy.las"), labels);
  require(copy.size() == input.size(), "a copy with labels is as long as its input");
  const auto [offset, mask] = las_class_byte(header.format);
  constexpr std::uint8_t kClasses[] = {0, 2, 1, 7};
  std::vector<std::uint8_t> expected(input.begin(), input.end());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == Label::kDropped) continue;
    std::uint8_t& byte = expected[header.points_offset + i * header.record_bytes + offset];
    byte = static_cast<std::uint8_t>((byte & ~mask) | kClasses[static_cast<std::size_t>(labels[i])]);
  }
  require(copy == expected, "a copy with labels differs in nothing but classes");
}

}  // namespace

void las(Bytes bytes) {
  const auto path = file_of(bytes, ".las");
  accepted([&] { require(read_las_classes(path).size() == open_las(path)->size(), "every point has a class"); });
  accepted([&] {
    const auto file = open_las(path);
    check_las_copy(bytes, *file, read_points(*file));
  });
}

void pcd(Bytes bytes) {
  const auto path = file_of(bytes, ".pcd");
  accepted([&] {
    const auto file = open_pcd(path);
    const PointBlock all = read_points(*file);
    const auto labels = written(*create_byte_labels(*file, folder() / "copy.labels"), some_labels(all));
    require(labels.size() == all.size(), "a byte a point");
  });
}

void ply(Bytes bytes) {
  accepted([&] { read_points(*open_ply(file_of(bytes, ".ply"))); });
}

void npy(Bytes bytes) {
  accepted([&] { read_points(*open_npy(file_of(bytes, ".npy"))); });
}

void xyz(Bytes bytes) {
  const auto path = file_of(bytes, ".xyz");
  accepted([&] { read_points(*open_xyz(path)); });
  accepted([&] { read_points(*open_xyz(path, "3,1,2")); });
  accepted([&] { read_xyz_classes(path); });
}

void kitti(Bytes bytes) {
  accepted([&] {
    const auto file = open_kitti(file_of(bytes, ".bin"));
    const PointBlock all = read_points(*file);
    const std::vector<Label> labels = some_labels(all);
    const auto text = written(*create_kitti_labels(*file, folder() / "copy.label"), labels);
    const auto classes = read_kitti_classes(file_of(text, ".label"));
    require(classes.size() == labels.size(), "a class a point");
    constexpr std::uint32_t kClasses[] = {0, 40, 99, 99};
    for (std::size_t i = 0; i < classes.size(); ++i)
      require(classes[i] == kClasses[static_cast<std::size_t>(labels[i])], "classes read back as they were written");
  });
}

}  // namespace btms::fuzz
