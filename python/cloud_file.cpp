// Point clouds from the bytes of files, by the readers of the program.
#include "cloud_file/cloud_file.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/string_view.h>

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "python/arrays.hpp"
#include "python/bindings.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {
namespace {

cloud_file::Points parse(const nb::bytes& content, std::string_view name) {
  const nb::gil_scoped_release unlocked;
  return cloud_file::parse_cloud({content.c_str(), content.size()}, name);
}

nb::object parse_cloud(const nb::bytes& content, std::string_view name) {
  try {
    const cloud_file::Points points = parse(content, name);
    const std::array<std::size_t, 2> shape{points.size(), 3};
    if (points.empty()) return float_array({}, shape);
    return float_array({points.front().data(), 3 * points.size()}, shape);
  } catch (const cloud_file::CloudFileError& error) {
    throw nb::value_error(error.what());
  }
}

}  // namespace

void bind_cloud_file(nb::module_& module) {
  module.def(
      "parse_cloud", &parse_cloud, "content"_a, "name"_a = "",
      "The points (N, 3), float64, of a PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY file, from its\n"
      "bytes. `name` helps to tell the format where the first bytes do not. Coordinates are\n"
      "as written, NaN included. Raises ValueError that says where the file is wrong.");
}

}  // namespace vnreg::python
