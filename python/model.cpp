// Class Model.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <cstddef>
#include <string>

#include "python/bindings.hpp"
#include "python/builtin_model.hpp"
#include "vnreg/vnreg.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {

const Model& builtin_model() {
  static const Model model = Model::builtin();
  return model;
}

void bind_model(nb::module_& module) {
  nb::class_<Model>(module, "Model", "Weights and hyper-parameters; immutable, may be shared.")
      .def_static(
          "load",
          [](nb::handle path) {
            const nb::bytes encoded(nb::module_::import_("os").attr("fsencode")(path));
            const std::string name(encoded.c_str(), encoded.size());
            const nb::gil_scoped_release unlocked;
            return Model::load(name);
          },
          "path"_a, "Reads a `.vnr` file (str or path-like). Raises Error.")
      .def_static(
          "from_bytes",
          [](const nb::bytes& content) {
            const auto* data = static_cast<const std::byte*>(content.data());
            return Model::from_bytes({data, content.size()});
          },
          "content"_a, "Reads a model from the bytes of a `.vnr` file. Raises Error.")
      .def_static("builtin", &builtin_model, "The weights compiled into the library.")
      .def_prop_ro("name", &Model::name, "The model's name, str.")
      .def_prop_ro("points", &Model::points,
                   "Points per cloud that the model was trained with; larger clouds are subsampled "
                   "to as many by default.")
      .def_prop_ro("min_points", &Model::min_points, "The fewest points a cloud must have.")
      .def("__repr__", [](const Model& model) {
        return "vnreg.Model(name='" + std::string(model.name()) +
               "', points=" + std::to_string(model.points()) + ")";
      });
}

}  // namespace vnreg::python
