// The Python module, a file a concept. Every function that takes time lets other Python threads run.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace btms::python {

namespace py = pybind11;

void add_map(py::module_& module);
void add_scans(py::module_& module);
void add_build(py::module_& module);

}  // namespace btms::python
