#include "io/points/xyz.h"

#include "io/points/metres.h"
#include "io/points/xyz_header.h"

namespace btms {
namespace {

class XyzFile final : public PointFile {
 public:
  XyzFile(const std::filesystem::path& path, const std::string& columns)
      : PointFile(path), header_(read_xyz_header(file_, columns)), lines_(file_, header_.lines) {
    constexpr std::string_view kAxes = "xyz";
    info_.format = "text";
    for (std::size_t axis = 0; axis < 3; ++axis)
      info_.format += std::string(axis == 0 ? ", " : " ") + kAxes[axis] + " in column " +
                      std::to_string(header_.lines.xyz[axis] + 1) + (axis < 2 ? "," : "");
    info_.points = lines_.points();
    if (info_.points == 0) info_.warnings.emplace_back("the file has no points");
    if (header_.count && *header_.count != info_.points)
      info_.warnings.push_back("the file says it has " + std::to_string(*header_.count) + " points, found " +
                               std::to_string(info_.points));
    if (info_.points > 0) {  // what is no number here is none in the other lines either
      PointBlock first;
      read(0, 1, first);
    }
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    read_lines(lines_, file_, first, count, block);
  }

  XyzHeader header_;
  PointLines lines_;
};

}  // namespace

std::unique_ptr<PointFile> open_xyz(const std::filesystem::path& path, const std::string& columns) {
  return std::make_unique<XyzFile>(path, columns);
}

std::vector<std::uint32_t> read_xyz_classes(const std::filesystem::path& path) {
  const InputFile file(path);
  const XyzHeader header = read_xyz_header(file, {});
  if (!header.class_column)
    file.refuse("no column is called class, classification or label; expected names in a line above the points");
  LineLayout layout = header.lines;
  layout.xyz.fill(*header.class_column);
  layout.names.fill("the class");
  const PointLines lines(file, layout);
  std::vector<std::uint32_t> classes;
  classes.reserve(lines.points());
  std::vector<std::uint8_t> scratch;
  lines.read(file, 0, static_cast<std::size_t>(lines.points()), scratch, [&](const double* value) {
    if (!(*value >= 0 && *value <= UINT32_MAX && *value == static_cast<double>(static_cast<std::uint32_t>(*value))))
      file.refuse("the class of point " + std::to_string(classes.size() + 1) + " is no whole number");
    classes.push_back(static_cast<std::uint32_t>(*value));
  });
  return classes;
}

}  // namespace btms
