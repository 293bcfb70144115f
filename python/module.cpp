// The Python module.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <string>

#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "vnreg/vnreg.hpp"

NB_MODULE(_vnreg, module) {
  module.doc() = "Rigid registration of two point clouds from any starting pose.";
  module.attr("__version__") = std::string(vnreg::version());
  module.def("instruction_set", &vnreg::instruction_set,
             "The instruction set this build was compiled for, such as 'x86-64-v3'.");
  vnreg::python::bind_error(module);
  vnreg::python::bind_cloud_file(module);
  vnreg::python::bind_model(module);
  vnreg::python::bind_result(module);
  vnreg::python::bind_viewer(module);
  vnreg::python::bind_registrar(module);
}
