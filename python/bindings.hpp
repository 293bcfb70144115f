// The parts of the module; each adds its classes and functions.
#pragma once

#include <nanobind/nanobind.h>

namespace vnreg::python {

/// parse_cloud.
void bind_cloud_file(nanobind::module_& module);
void bind_model(nanobind::module_& module);
/// Result and Alternative.
void bind_result(nanobind::module_& module);
/// Registrar, PreparedCloud, Cancellation, align and align_many.
void bind_registrar(nanobind::module_& module);
/// Explanation, and the viewer's page.
void bind_viewer(nanobind::module_& module);

}  // namespace vnreg::python
