// Directions over the sphere, 20 degrees apart.
#pragma once

#include <cstddef>

namespace vnreg::detail {

/// A multiple of three packets.
inline constexpr std::ptrdiff_t half_space_directions = 96;

/// Unit vectors.
struct SphereDirections {
  alignas(64) float x[half_space_directions], y[half_space_directions], z[half_space_directions];

  /// A Fibonacci lattice: equal areas, no two directions close.
  SphereDirections() noexcept;
};

extern const SphereDirections sphere_directions;

}  // namespace vnreg::detail
