#include "python/errors.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <exception>
#include <string>

#include "vnreg/error.hpp"

namespace nb = nanobind;

namespace vnreg::python {
namespace {

void raise(const Error& error, nb::handle type) {
  nb::object instance = type(error.what());
  instance.attr("code") = to_string(error.code());
  instance.attr("field") = error.field();
  instance.attr("expected") = error.expected();
  instance.attr("got") = error.got();
  PyErr_SetObject(type.ptr(), instance.ptr());
}

void translate(const std::exception_ptr& exception, void* type) {
  try {
    std::rethrow_exception(exception);
  } catch (const Error& error) {
    raise(error, nb::handle(static_cast<PyObject*>(type)));
  }
}

constexpr const char* documentation =
    "A model that cannot be loaded or an option out of its range.\n\n"
    "code: 'file_unreadable', 'not_a_model', 'unsupported_version', 'corrupt_model',\n"
    "'wrong_architecture', 'missing_tensor', 'invalid_option' or 'unsupported_cpu'.\n"
    "field, expected, got: where it is wrong, and both values (str).";

}  // namespace

void bind_error(nb::module_& module) {
  nb::object type = nb::steal(
      PyErr_NewExceptionWithDoc("vnreg.Error", documentation, PyExc_RuntimeError, nullptr));
  if (!type.is_valid()) throw nb::python_error();
  module.attr("Error") = type;
  // The translator outlives the module: it keeps a reference of its own.
  nb::register_exception_translator(translate, type.release().ptr());
}

}  // namespace vnreg::python
