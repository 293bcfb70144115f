// A grid of cells over a cloud, each with the point nearest to its centre: nearest neighbours in a
// few nanoseconds, for the many poses whose fit only has to be compared.
//
// A query takes the point of its cell. If the cell's centre is c and the query q lies in the cell,
// |q - c| <= e, half the cell's diagonal; with p the point found and p* the nearest of all,
//   |q - p| <= |q - c| + |c - p| <= e + |c - p*| <= 2 e + |q - p*|,
// so the point found is at most one cell diagonal farther than the nearest.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/neighbours.hpp"
#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

class NearestGrid {
 public:
  /// Cells along the longest side of the box. A multiple of `block`.
  static constexpr Index cells = 28;
  /// Cells along the sides of the cubes that share a point where all points are far.
  static constexpr Index block = 4;

  /// Allocates for clouds of at most 65,536 points.
  void allocate() { nearest_.resize(static_cast<std::size_t>(cells * cells * cells)); }

  /// Lays cubic cells over the bounding box of the points, widened by `margin` (positive) on all
  /// sides. Cells whose centres are farther than `reach` from every point hold the point nearest to
  /// the centre of their block: the bound above then does not hold.
  void place(const SpatialIndex& index, float margin, float reach) noexcept;
  /// Finds the points of a slab of blocks across z, one of slabs(). Slabs are independent.
  void fill(const SpatialIndex& index, Index slab, NeighbourScratch& scratch) noexcept;

  Index slabs() const noexcept { return counts_[2] / block; }
  /// How many cells there are.
  Index size() const noexcept { return counts_[0] * counts_[1] * counts_[2]; }
  float cell_size() const noexcept { return size_; }

  /// A place in the input of the index. Outside of the box: that of the cell of the box nearest by.
  std::uint16_t nearest(float x, float y, float z) const noexcept {
    return nearest_[static_cast<std::size_t>(cell_of(x, y, z))];
  }
  /// The same for `count` queries.
  void nearest(const Coordinates& queries, Index count, std::uint16_t* places) const noexcept;

 private:
  class Slab;
  void store(const SpatialIndex& index, const Slab& slab, Index first_layer,
             NeighbourScratch& scratch) noexcept;
  /// In cells from the centre of the first.
  float place_of(int axis, float value) const noexcept {
    return (value - low_[axis]) * per_size_ - 0.5f;
  }
  float centre(int axis, Index cell) const noexcept {
    return low_[axis] + (static_cast<float>(cell) + 0.5f) * size_;
  }

  std::int32_t cell_of(float x, float y, float z) const noexcept {
    return (place_along(2, z) * rows_ + place_along(1, y)) * columns_ + place_along(0, x);
  }
  std::int32_t place_along(int axis, float value) const noexcept {
    const float place = (value - low_[axis]) * per_size_;
    // In this order NaN gives 0.
    const float raised = place > 0.0f ? place : 0.0f;
    return static_cast<std::int32_t>(raised < last_[axis] ? raised : last_[axis]);
  }

  float low_[3] = {0, 0, 0};
  float last_[3] = {0, 0, 0};  // cells along the axis, less one
  Index counts_[3] = {0, 0, 0};
  std::int32_t columns_ = 0, rows_ = 0;  // cells along x and y
  float size_ = 1;
  float per_size_ = 1;
  float reach_ = 0;
  std::vector<std::uint16_t> nearest_;
};

}  // namespace vnreg::kernels
