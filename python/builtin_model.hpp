// The built-in model, read once.
#pragma once

#include "vnreg/vnreg.hpp"

namespace vnreg::python {

const Model& builtin_model();

}  // namespace vnreg::python
