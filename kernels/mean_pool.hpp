// Mean over the points of a cloud, in two steps: sums per tile, then their combination in the order
// of the tiles, so that the result does not depend on which thread took which tile.
#pragma once

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Sums the `points` columns of each component of a tile: `sums` is rows x 3, columns `rows` apart.
void sum_tile(const float* tile, Index rows, Index points, float* sums) noexcept;

/// mean = (sums of tile 0 + sums of tile 1 + ...) / points, added up in float64. `sums` holds
/// `tiles` consecutive rows x 3 blocks.
void mean_of_tiles(const float* sums, Index rows, Index tiles, Index points, float* mean) noexcept;

}  // namespace vnreg::kernels
