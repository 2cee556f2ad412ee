#include "apps/python/module.h"

#include "engine/error.h"
#include "engine/terrain/parameters.h"

namespace btms::python {
namespace {

// btms.Error with the code that the command line has as exit status: .code, .file.
void add_errors(py::module_& module) {
  static PyObject* type = PyErr_NewExceptionWithDoc(
      "btms.Error",
      "What went wrong; .code is 'usage', 'bad_input', 'verification', 'cancelled' or 'failed', .file a path.",
      PyExc_RuntimeError, nullptr);
  module.attr("Error") = py::handle(type);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      py::object made = py::reinterpret_borrow<py::object>(type)(error.what());
      made.attr("code") = error_name(error.code());
      made.attr("file") = error.file();
      PyErr_SetObject(type, made.ptr());
    }
  });
}

py::dict parameters_dict(const Parameters& p) {
  py::dict dict;
  for (const ParameterInfo& info : parameter_table()) {
    const std::string text = parameter_text(p, info);
    py::object value = py::str(text);
    if (info.choices.empty()) value = py::module_::import("json").attr("loads")(text);
    dict[py::str(std::string(info.name))] = value;
  }
  return dict;
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "B-TMS Engine: terrain from point clouds.";
  module.attr("__version__") = BTMS_VERSION;
  add_errors(module);
  module.def(
      "presets", [] { return preset_names(); }, "Names of the presets.");
  module.def(
      "parameters", [](const std::string& name) { return parameters_dict(preset(name)); }, py::arg("preset") = "city",
      "The parameters of a preset, by name.");
  add_map(module);
  add_scans(module);
  add_build(module);
}

}  // namespace btms::python
