// Scans in memory: labels for points, without a copy of what is float32.
#include <cstring>

#include "apps/python/arrays.h"
#include "engine/tiling/millimetres.h"
#include "engine/tiling/scan_segmenter.h"

namespace btms::python {
namespace {

// float64 points as a source: rounded to the millimetre straight from the array.
class DoubleRows final : public PointSource {
 public:
  explicit DoubleRows(const Rows& rows) : rows_(rows) {}
  std::string name() const override { return "array"; }
  std::uint64_t size() const override { return static_cast<std::uint64_t>(rows_.size()); }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    block.reset(count);
    double xyz[3][kMmChunk];
    for (std::size_t at = 0; at < count; at += kMmChunk) {
      const std::size_t n = std::min(kMmChunk, count - at);
      for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < n; ++i) xyz[axis][i] = rows_.at(static_cast<py::ssize_t>(first + at + i), axis);
      const MmColumn<double> columns[3] = {{xyz[0], 1000, 0}, {xyz[1], 1000, 0}, {xyz[2], 1000, 0}};
      round_into(columns, n, block, at);
    }
  }

 private:
  const Rows& rows_;
};

class Segmenter {
 public:
  Segmenter(const std::string& preset_name, const py::kwargs& changes) : segmenter_(made(preset_name, changes)) {}

  py::array_t<std::uint8_t> segment(const py::object& points) {
    const Rows rows = rows_of(points, 3, "points");
    std::span<const Label> labels;
    {
      const py::gil_scoped_release others;
      labels = rows.is_double ? segmenter_.segment(DoubleRows(rows)) : segmenter_.segment(floats(rows));
    }
    py::array_t<std::uint8_t> out(static_cast<py::ssize_t>(labels.size()));
    std::memcpy(out.mutable_data(), labels.data(), labels.size());
    return out;
  }

 private:
  static Parameters made(const std::string& name, const py::kwargs& changes) {
    Parameters p = preset(name);
    for (const auto& [key, value] : changes)
      set_parameter(p, py::str(key).cast<std::string>(), py::str(value).cast<std::string>());
    return p;
  }
  static ScanPoints floats(const Rows& rows) {
    const auto column = [&](int axis) {
      return reinterpret_cast<const float*>(rows.data() + axis * rows.column_bytes());
    };
    return {column(0), column(1), column(2), static_cast<std::size_t>(rows.size()),
            static_cast<std::size_t>(rows.row_bytes())};
  }
  ScanSegmenter segmenter_;
};

}  // namespace

void add_scans(py::module_& module) {
  module.attr("DROPPED") = static_cast<int>(Label::kDropped);
  module.attr("TERRAIN") = static_cast<int>(Label::kTerrain);
  module.attr("OBSTACLE") = static_cast<int>(Label::kObstacle);
  module.attr("BELOW") = static_cast<int>(Label::kBelow);
  py::class_<Segmenter>(module, "Segmenter",
                        "Labels scan after scan in kept memory, on one thread; one object a thread.")
      .def(py::init<const std::string&, const py::kwargs&>(), py::arg("preset") = "single-scan",
           "A preset, and parameters that are to be others: Segmenter('single-scan', resolution_m=1).")
      .def("segment", &Segmenter::segment, py::arg("points"),
           "Labels (N,) uint8 of points (N, 3 or more): x, y, z in metres, z up. float32 and float64 arrays are read "
           "where "
           "they lie, whatever their strides.");
}

}  // namespace btms::python
