#include "engine/half_spaces.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace vnreg::detail {
namespace {

constexpr Index points_per_excess = 80;

struct Directions {
  alignas(64) float x[half_space_directions], y[half_space_directions], z[half_space_directions];

  /// A Fibonacci lattice: equal areas, no two directions close.
  Directions() noexcept {
    constexpr double golden_angle = std::numbers::pi * (3.0 - 2.2360679774997896964);
    for (Index i = 0; i < half_space_directions; ++i) {
      const double height = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / half_space_directions;
      const double across = std::sqrt(1.0 - height * height);
      const double angle = golden_angle * static_cast<double>(i);
      x[i] = static_cast<float>(across * std::cos(angle));
      y[i] = static_cast<float>(across * std::sin(angle));
      z[i] = static_cast<float>(height);
    }
  }
};

const Directions directions;

}  // namespace

void measure_extents(const kernels::Coordinates& points, Index count, float* projections,
                     Extents& extents) noexcept {
  const Index excess = count / points_per_excess;
  for (Index k = 0; k < half_space_directions; ++k) {
    const float dx = directions.x[k], dy = directions.y[k], dz = directions.z[k];
#pragma omp simd
    for (Index i = 0; i < count; ++i) {
      projections[i] = points.x[i] * dx + points.y[i] * dy + points.z[i] * dz;
    }
    std::nth_element(projections, projections + excess, projections + count, std::greater<>());
    extents[static_cast<std::size_t>(k)] = projections[excess];
  }
}

HalfSpace most_beyond(const kernels::Coordinates& points, Index count,
                      const Extents& extents) noexcept {
  alignas(64) float beyond[half_space_directions] = {};
  for (Index i = 0; i < count; ++i) {
    const float x = points.x[i], y = points.y[i], z = points.z[i];
#pragma omp simd
    for (Index k = 0; k < half_space_directions; ++k) {
      const float along = x * directions.x[k] + y * directions.y[k] + z * directions.z[k];
      beyond[k] += along > extents[static_cast<std::size_t>(k)] ? 1.0f : 0.0f;
    }
  }
  const auto best = std::max_element(beyond, beyond + half_space_directions) - beyond;
  return {directions.x[best], directions.y[best], directions.z[best],
          extents[static_cast<std::size_t>(best)], static_cast<Index>(beyond[best])};
}

}  // namespace vnreg::detail
