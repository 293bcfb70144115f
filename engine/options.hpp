// What Options may say.
#pragma once

#include "engine/model_data.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

/// Throws Error (invalid_option).
void check_threads(int threads);

/// The number of points to make room for. Throws Error (invalid_option) where an option is out of
/// its range, or the model cannot do what it asks.
Index checked_max_points(const ModelData& model, const Options& options);

}  // namespace vnreg::detail
