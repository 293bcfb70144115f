// Compiled for every processor (CMakeLists.txt): this runs when the library is loaded.
#include "engine/sphere_directions.hpp"

#include <cmath>
#include <numbers>

namespace vnreg::detail {

SphereDirections::SphereDirections() noexcept {
  constexpr double golden_angle = std::numbers::pi * (3.0 - 2.2360679774997896964);
  for (std::ptrdiff_t i = 0; i < half_space_directions; ++i) {
    const double height = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / half_space_directions;
    const double across = std::sqrt(1.0 - height * height);
    const double angle = golden_angle * static_cast<double>(i);
    x[i] = static_cast<float>(across * std::cos(angle));
    y[i] = static_cast<float>(across * std::sin(angle));
    z[i] = static_cast<float>(height);
  }
}

const SphereDirections sphere_directions;

}  // namespace vnreg::detail
