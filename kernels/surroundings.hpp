// How much of a cloud lies near a place, where, and how it spreads: the moments of order 0 to 2
// within a few radii (docs/design.md). Unlike kernels/moments.hpp, for places that may be far from
// all points.
#pragma once

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

inline constexpr Index surroundings_radii = 2;

/// With weights w = (1 - d^2/r^2)^2 of the points at distance d < r, and W their sum: what W + 1e-3
/// stands below keeps both moments finite, and zero where there is nothing.
struct Surroundings {
  float weight = 0;          // W / number of points
  float offset[3] = {};      // o = sum of w d / (W r)
  float covariance[6] = {};  // xx, xy, xz, yy, yz, zz of 4 (sum of w d d^T / (W r^2) - o o^T)
};

/// `leaf_bounds` is room for index.leaves() numbers.
void surroundings(const SpatialIndex& index, const float centre[3],
                  const float radii[surroundings_radii], float* leaf_bounds,
                  Surroundings out[surroundings_radii]) noexcept;

}  // namespace vnreg::kernels
