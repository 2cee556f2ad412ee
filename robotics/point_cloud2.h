// Between point clouds as ROS 1 and ROS 2 send them (sensor_msgs/PointCloud2) and btms::ScanSegmenter: where x, y and z
// lie in the caller's memory, and back to a cloud of the ground and one of the obstacles. C++17, no ROS, nothing else
// of btms; a message type is only a template parameter.
//
//   std::vector<float> scratch;
//   const auto xyz = btms::columns_of(btms::view_of(message), scratch);
//   const auto labels = segmenter.segment({xyz.x_m, xyz.y_m, xyz.z_m, xyz.size, xyz.stride_bytes});
//   btms::split(btms::view_of(message), labels.data(), labels.size(), ground.data, obstacles.data);
//
// Nothing is trusted: what doesn't fit into the cloud's memory is std::invalid_argument.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace btms {

// A cloud in somebody's memory: `height` rows of `width` points, `row_step` bytes from row to row.
struct CloudView {
  struct Field {
    std::uint32_t offset = 0;
    bool is_double = false;  // float64, else float32
  };
  const std::uint8_t* data = nullptr;
  std::size_t data_bytes = 0;
  std::uint32_t width = 0, height = 0, point_step = 0, row_step = 0;
  Field x, y, z;
  bool big_endian = false;

  std::size_t points() const { return std::size_t{width} * height; }
  const std::uint8_t* point(std::size_t i) const { return data + i / width * row_step + i % width * point_step; }
};

// x, y and z, each `stride_bytes` from a point to the next: what btms::ScanPoints holds, in its order. Values may begin
// at any byte.
struct Columns {
  const float *x_m = nullptr, *y_m = nullptr, *z_m = nullptr;
  std::size_t size = 0, stride_bytes = sizeof(float);
};

namespace detail {

inline bool machine_is_big_endian() {
  const std::uint16_t one = 1;
  std::uint8_t first;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

template <class T>
T number_at(const std::uint8_t* from, bool swapped) {
  std::uint8_t bytes[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = from[swapped ? sizeof(T) - 1 - i : i];
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace detail

// Throws std::invalid_argument for a cloud that says more than its memory holds.
inline void check(const CloudView& cloud) {
  const auto refuse = [](const char* why) { throw std::invalid_argument(std::string("not a point cloud: ") + why); };
  for (const CloudView::Field& field : {cloud.x, cloud.y, cloud.z})
    if (std::uint64_t{field.offset} + (field.is_double ? 8 : 4) > cloud.point_step)
      refuse("a field ends behind its point");
  if (cloud.width == 0 || cloud.height == 0) return;
  const std::uint64_t row_bytes = std::uint64_t{cloud.width} * cloud.point_step;  // below 2^64, as what follows
  if (cloud.height > 1 && cloud.row_step < row_bytes) refuse("points end behind their row");
  const std::uint64_t rows_bytes = std::uint64_t{cloud.height - 1} * cloud.row_step;
  if (row_bytes > cloud.data_bytes || rows_bytes > cloud.data_bytes - row_bytes) refuse("its data are too short");
}

// Of a message that outlives the view. Throws std::invalid_argument without x, y and z as single floats or doubles.
template <class PointCloud2>
CloudView view_of(const PointCloud2& message) {
  constexpr int kFloat32 = 7, kFloat64 = 8;  // sensor_msgs/PointField
  CloudView cloud;
  cloud.data = message.data.data();
  cloud.data_bytes = message.data.size();
  cloud.width = message.width;
  cloud.height = message.height;
  cloud.point_step = message.point_step;
  cloud.row_step = message.row_step;
  cloud.big_endian = message.is_bigendian;
  int found = 0;
  for (const auto& field : message.fields) {
    CloudView::Field* wanted = field.name == "x"   ? &cloud.x
                               : field.name == "y" ? &cloud.y
                               : field.name == "z" ? &cloud.z
                                                   : nullptr;
    if (!wanted) continue;
    if ((field.datatype != kFloat32 && field.datatype != kFloat64) || field.count > 1)
      throw std::invalid_argument("not a point cloud: " + field.name + " is not a float or a double");
    *wanted = {field.offset, field.datatype == kFloat64};
    found |= 1 << (wanted == &cloud.y ? 1 : wanted == &cloud.z ? 2 : 0);
  }
  if (found != 7) throw std::invalid_argument("not a point cloud: there is no field x, y or z");
  check(cloud);
  return cloud;
}

// Points into the cloud's memory where that holds float32 in the machine's byte order, without gaps between rows, as
// those of drivers do; else `scratch` takes a copy. Valid while both are. Throws as check().
inline Columns columns_of(const CloudView& cloud, std::vector<float>& scratch) {
  check(cloud);
  Columns columns;
  columns.size = cloud.points();
  if (columns.size == 0) return columns;
  const bool swapped = cloud.big_endian != detail::machine_is_big_endian();
  const bool gaps = cloud.height > 1 && cloud.row_step != std::uint64_t{cloud.width} * cloud.point_step;
  if (!swapped && !gaps && !cloud.x.is_double && !cloud.y.is_double && !cloud.z.is_double) {
    const auto at = [&](const CloudView::Field& f) { return reinterpret_cast<const float*>(cloud.data + f.offset); };
    columns.x_m = at(cloud.x);
    columns.y_m = at(cloud.y);
    columns.z_m = at(cloud.z);
    columns.stride_bytes = cloud.point_step;
    return columns;
  }
  scratch.resize(3 * columns.size);
  std::size_t n = 0;
  for (std::size_t i = 0; i < columns.size; ++i)
    for (const CloudView::Field& f : {cloud.x, cloud.y, cloud.z}) {
      const std::uint8_t* from = cloud.point(i) + f.offset;
      scratch[n++] = f.is_double ? static_cast<float>(detail::number_at<double>(from, swapped))
                                 : detail::number_at<float>(from, swapped);
    }
  columns.x_m = scratch.data();
  columns.y_m = scratch.data() + 1;
  columns.z_m = scratch.data() + 2;
  columns.stride_bytes = 3 * sizeof(float);
  return columns;
}

// The records of the ground and of the obstacles, whole and in order, each a row of point_step bytes: with height 1 and
// the fields of the cloud they are clouds again. `labels` are btms::Label or their numbers (1 terrain, 2 obstacle);
// points that were dropped, or lie below the ground, are in neither. Throws as check(), or for another number of
// labels.
template <class LabelType>
void split(const CloudView& cloud, const LabelType* labels, std::size_t count, std::vector<std::uint8_t>& ground,
           std::vector<std::uint8_t>& obstacles) {
  check(cloud);
  if (count != cloud.points()) throw std::invalid_argument("there is not one label for each point");
  ground.clear();
  obstacles.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const int label = static_cast<int>(labels[i]);
    if (label != 1 && label != 2) continue;
    std::vector<std::uint8_t>& to = label == 1 ? ground : obstacles;
    const std::uint8_t* record = cloud.point(i);
    to.insert(to.end(), record, record + cloud.point_step);
  }
}

}  // namespace btms
