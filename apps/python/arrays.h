// Rows of points in NumPy arrays.
#pragma once

#include <cstdint>
#include <string>

#include "apps/python/module.h"
#include "engine/error.h"
#include "engine/query/place.h"

namespace btms::python {

// An (N, least or more) array of float32 or float64 as it lies in memory; other numbers are converted, once.
struct Rows {
  py::array array;
  bool is_double = false;

  py::ssize_t size() const { return array.shape(0); }
  const char* data() const { return static_cast<const char*>(array.data()); }
  py::ssize_t row_bytes() const { return array.strides(0); }
  py::ssize_t column_bytes() const { return array.strides(1); }
  double at(py::ssize_t row, py::ssize_t column) const {
    const char* from = data() + row * row_bytes() + column * column_bytes();
    return is_double ? *reinterpret_cast<const double*>(from)
                     : static_cast<double>(*reinterpret_cast<const float*>(from));
  }
};

inline Rows rows_of(const py::object& object, py::ssize_t least, const char* what) {
  py::array array = py::array::ensure(object);
  if (!array || array.ndim() != 2 || array.shape(1) < least)
    throw Error(ErrorCode::kUsage,
                std::string(what) + ": expected an array of shape (N, " + std::to_string(least) + ")");
  const bool is_float = py::isinstance<py::array_t<float>>(array),
             is_double = py::isinstance<py::array_t<double>>(array);
  if (!is_float && !is_double) array = py::array_t<double>::ensure(array);
  if (!array) throw Error(ErrorCode::kUsage, std::string(what) + ": expected numbers");
  return {array, !is_float};
}

inline std::vector<Place> places_of(const py::object& object, const char* what) {
  const Rows rows = rows_of(object, 2, what);
  std::vector<Place> places;
  places.reserve(static_cast<std::size_t>(rows.size()));
  for (py::ssize_t i = 0; i < rows.size(); ++i) places.push_back({rows.at(i, 0), rows.at(i, 1)});
  return places;
}

inline Place place_of(const py::object& object, const char* what) {
  const py::sequence pair = py::reinterpret_borrow<py::sequence>(object);
  if (!py::isinstance<py::sequence>(object) || py::len(pair) != 2)
    throw Error(ErrorCode::kUsage, std::string(what) + ": expected (x, y)");
  return {pair[0].cast<double>(), pair[1].cast<double>()};
}

}  // namespace btms::python
