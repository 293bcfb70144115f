// Sums of rows of numbers over the points within a radius of a point, with weights (1 - d^2/r^2)^2
// that add up to 1: the neighbourhood layers of the network `vnreg` (docs/design.md).
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

/// Room for the neighbours of one point.
struct CollectScratch {
  CollectScratch() = default;
  explicit CollectScratch(Index max_points);

  Floats weight_of;                   // of every point
  std::vector<std::uint32_t> nearby;  // points with a weight
};

/// out = sum_j w_j row_j over the `count` points, where row_j starts at rows + j * length; `length`
/// is a multiple of the packet size. `self` is one of the points.
void collect_rows(const Coordinates& points, Index count, Index self, float radius,
                  const float* rows, Index length, CollectScratch& scratch, float* out) noexcept;

}  // namespace vnreg::kernels
