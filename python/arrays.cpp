#include "python/arrays.hpp"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace nb = nanobind;

namespace vnreg::python {
namespace {

/// The buffer protocol's letter, without the mark of native or (the same here) little-endian order.
char scalar_code(const Py_buffer& buffer) noexcept {
  std::string_view format = buffer.format == nullptr ? "B" : buffer.format;
  if (format.starts_with('<') || format.starts_with('=') || format.starts_with('@')) {
    format.remove_prefix(1);
  }
  return format.size() == 1 ? format.front() : '?';
}

bool readable_as_is(const Py_buffer& buffer) noexcept {
  const char code = scalar_code(buffer);
  return (code == 'f' || code == 'd') && buffer.ndim == 2 && buffer.shape[1] == 3 &&
         buffer.strides[0] >= 0 && buffer.strides[1] >= 0;
}

/// str() of an attribute.
std::string text_of(nb::handle array, const char* attribute) {
  const nb::object value = array.attr(attribute);
  return nb::str(value).c_str();
}

/// A float64 copy in row order; throws where the array is not (N, 3) numbers.
nb::object converted(const nb::module_& numpy, nb::handle points, const char* argument) {
  nb::object array = numpy.attr("asarray")(points);
  const std::string kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
  if (std::string_view("iuf").find(kind) == std::string_view::npos) {
    const std::string message = std::string(argument) + ": expected an array of real numbers, " +
                                "got dtype " + text_of(array, "dtype");
    throw nb::type_error(message.c_str());
  }
  const auto ndim = nb::cast<std::size_t>(array.attr("ndim"));
  if (ndim != 2 || nb::cast<std::size_t>(array.attr("shape")[1]) != 3) {
    const std::string message =
        std::string(argument) + ": expected shape (N, 3), got " + text_of(array, "shape");
    throw nb::value_error(message.c_str());
  }
  return numpy.attr("ascontiguousarray")(array, nb::arg("dtype") = numpy.attr("float64"));
}

template <class T>
nb::object new_array(std::span<const double> values, std::span<const std::size_t> shape) {
  auto memory = std::make_unique<T[]>(std::max<std::size_t>(values.size(), 1));
  std::transform(values.begin(), values.end(), memory.get(),
                 [](double value) { return static_cast<T>(value); });
  nb::capsule owner(memory.get(), [](void* p) noexcept { delete[] static_cast<T*>(p); });
  T* data = memory.release();
  return nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner).cast();
}

}  // namespace

BorrowedPoints::BorrowedPoints(nb::handle points, const char* argument) {
  if (borrow(points)) return;
  // Clouds and meshes of other libraries; what they are is decided in Python.
  nb::object held = nb::module_::import_("vnreg._clouds").attr("points_of")(points);
  if (borrow(held)) return;
  const nb::module_ numpy = nb::module_::import_("numpy");
  if (!borrow(converted(numpy, held, argument))) throw nb::python_error();
}

BorrowedPoints::~BorrowedPoints() { PyBuffer_Release(&buffer_); }

/// False when there is no buffer, or one that the engine cannot read. The buffer keeps its owner
/// alive.
bool BorrowedPoints::borrow(nb::handle points) {
  if (!PyObject_CheckBuffer(points.ptr())) return false;
  if (PyObject_GetBuffer(points.ptr(), &buffer_, PyBUF_RECORDS_RO) != 0) {
    PyErr_Clear();
    buffer_ = Py_buffer{};
    return false;
  }
  if (readable_as_is(buffer_)) return true;
  PyBuffer_Release(&buffer_);
  return false;
}

PointsView BorrowedPoints::view() const noexcept {
  const auto count = static_cast<std::size_t>(buffer_.shape[0]);
  const auto stride = static_cast<std::size_t>(buffer_.strides[0]);
  const auto axis_stride = static_cast<std::size_t>(buffer_.strides[1]);
  if (scalar_code(buffer_) == 'f') {
    return {static_cast<const float*>(buffer_.buf), count, stride, axis_stride};
  }
  return {static_cast<const double*>(buffer_.buf), count, stride, axis_stride};
}

nb::object float_array(std::span<const double> values, std::span<const std::size_t> shape) {
  return new_array<double>(values, shape);
}

nb::object index_array(std::span<const double> values, std::span<const std::size_t> shape) {
  return new_array<std::int64_t>(values, shape);
}

}  // namespace vnreg::python
