// Sums of rows of numbers over the points within a radius of a point, with weights (1 - d^2/r^2)^2
// that add up to 1: the neighbourhood layers of the network `vnreg` (docs/design.md).
//
// Points that are near in space are near in memory. A tile of them first lists what may be near to
// any; then four at a time, which share most of their neighbours, each row is read once for all
// four, while their sums stay in registers.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

/// Points that are summed for together.
inline constexpr Index collect_group = 4;

/// Room for the neighbours of a tile.
struct CollectScratch {
  CollectScratch() = default;
  explicit CollectScratch(Index max_points);

  std::vector<std::uint32_t> candidates;  // points that may be near to some point of the tile
  Floats x, y, z;                         // their places
  Floats squared[collect_group];          // their distances from the points of a group
  Floats least;                           // the least of those
  std::vector<std::uint32_t> nearby;      // the candidates within the radius of a group's point
  Floats weights;                         // theirs, for one point of the group after the other
};

/// For the points p = first .. first + width - 1 of `count`: row p - first of `out` = sum_j w_pj
/// row_j, where row_j starts at rows + j * length; `length` is a multiple of the packet size.
void collect_rows(const Coordinates& points, Index count, Index first, Index width, float radius,
                  const float* rows, Index length, CollectScratch& scratch, float* out) noexcept;

}  // namespace vnreg::kernels
