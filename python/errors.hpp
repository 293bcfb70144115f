// vnreg::Error as the Python exception `vnreg.Error`.
#pragma once

#include <nanobind/nanobind.h>

namespace vnreg::python {

/// Adds class Error to the module and raises it, with code, field, expected and got, wherever C++
/// throws vnreg::Error.
void bind_error(nanobind::module_& module);

}  // namespace vnreg::python
