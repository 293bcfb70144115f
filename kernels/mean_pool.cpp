#include "kernels/mean_pool.hpp"

namespace vnreg::kernels {

void sum_tile(const float* tile, Index rows, Index points, float* sums) noexcept {
  for (Index component = 0; component < 3; ++component, sums += rows) {
    const Eigen::Map<const Eigen::ArrayXXf> columns(tile + component * points * rows, rows, points);
    Eigen::Map<Eigen::ArrayXf> sum(sums, rows);
    sum = columns.col(0);
    for (Index p = 1; p < points; ++p) sum += columns.col(p);
  }
}

void mean_of_tiles(const float* sums, Index rows, Index tiles, Index points, float* mean) noexcept {
  const double share = 1.0 / static_cast<double>(points);
  for (Index i = 0; i < 3 * rows; ++i) {
    double total = 0;
    for (Index tile = 0; tile < tiles; ++tile)
      total += static_cast<double>(sums[tile * 3 * rows + i]);
    mean[i] = static_cast<float>(total * share);
  }
}

}  // namespace vnreg::kernels
