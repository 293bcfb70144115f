#include "kernels/nearest_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vnreg::kernels {
namespace {

constexpr Index block_cells = NearestGrid::block * NearestGrid::block * NearestGrid::block;

struct Nearest {
  float squared = std::numeric_limits<float>::infinity();
  Index place = 0;  // in the order of the index
};

/// The nearest point of a leaf, if it is nearer than `best`.
void search_leaf(const SpatialIndex& index, Index leaf, const float* q, Nearest& best) noexcept {
  alignas(64) float squared[SpatialIndex::leaf_size];
  index.leaf_distances(leaf, q[0], q[1], q[2], squared);
  for (Index i = 0; i < SpatialIndex::leaf_size; ++i) {
    if (squared[i] < best.squared) best = {squared[i], leaf * SpatialIndex::leaf_size + i};
  }
}

/// Leaves the bounds of all leaves in `bounds`.
Nearest find_nearest(const SpatialIndex& index, const float* q, float* bounds) noexcept {
  index.leaf_bounds(q[0], q[1], q[2], bounds);
  const Index start = std::min_element(bounds, bounds + index.leaves()) - bounds;
  Nearest best;
  search_leaf(index, start, q, best);
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    if (bounds[leaf] < best.squared && leaf != start) search_leaf(index, leaf, q, best);
  }
  return best;
}

/// The centres of a block's cells and what is nearest to them so far.
struct Cells {
  alignas(64) float x[block_cells], y[block_cells], z[block_cells];
  alignas(64) float squared[block_cells];
  alignas(64) std::int32_t place[block_cells];

  Cells(const float* first_centre, float size) noexcept {
    for (Index i = 0; i < block_cells; ++i) {
      x[i] = first_centre[0] + size * static_cast<float>(i % NearestGrid::block);
      y[i] =
          first_centre[1] + size * static_cast<float>(i / NearestGrid::block % NearestGrid::block);
      z[i] = first_centre[2] +
             size * static_cast<float>(i / (NearestGrid::block * NearestGrid::block));
    }
    std::fill_n(squared, block_cells, std::numeric_limits<float>::infinity());
    std::fill_n(place, block_cells, 0);
  }

  void offer(float px, float py, float pz, std::int32_t candidate) noexcept {
#pragma omp simd
    for (Index i = 0; i < block_cells; ++i) {
      const float dx = px - x[i], dy = py - y[i], dz = pz - z[i];
      const float distance = (dx * dx + dy * dy) + dz * dz;
      const bool nearer = distance < squared[i];
      squared[i] = nearer ? distance : squared[i];
      place[i] = nearer ? candidate : place[i];
    }
  }
};

}  // namespace

void NearestGrid::place(const SpatialIndex& index, float margin, float reach) noexcept {
  const Coordinates points = index.ordered();
  const float* coordinates[3] = {points.x, points.y, points.z};
  float sides[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax_element(coordinates[axis], coordinates[axis] + index.count());
    low_[axis] = *low - margin;
    sides[axis] = (*high - *low) + 2 * margin;
  }
  size_ = std::max({sides[0], sides[1], sides[2]}) / static_cast<float>(cells);
  per_size_ = 1.0f / size_;
  for (int axis = 0; axis < 3; ++axis) {
    // The longest side may come out as 28.000002 cells.
    const auto needed = static_cast<Index>(std::ceil(sides[axis] * per_size_ - 1e-3f));
    const Index whole_blocks = (std::max<Index>(needed, 1) + block - 1) / block * block;
    counts_[axis] = std::min(whole_blocks, cells);
    last_[axis] = static_cast<float>(counts_[axis] - 1);
  }
  columns_ = static_cast<std::int32_t>(counts_[0]);
  rows_ = static_cast<std::int32_t>(counts_[1]);
  reach_ = reach;
}

void NearestGrid::fill(const SpatialIndex& index, Index first, Index last,
                       NeighbourScratch& scratch) noexcept {
  // From a block's centre to the farthest centre of its cells.
  const float block_radius = std::sqrt(3.0f) * 0.5f * static_cast<float>(block - 1) * size_;
  const Coordinates points = index.ordered();
  const std::uint32_t* original = index.original();
  float* bounds = scratch.bounds.data();
  const Index blocks_x = counts_[0] / block;
  const Index blocks_y = counts_[1] / block;
  for (Index b = first; b < last; ++b) {
    const Index corner[3] = {b % blocks_x * block, b / blocks_x % blocks_y * block,
                             b / (blocks_x * blocks_y) * block};
    float centre[3], first_cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      first_cell[axis] = low_[axis] + (static_cast<float>(corner[axis]) + 0.5f) * size_;
      centre[axis] = first_cell[axis] + 0.5f * static_cast<float>(block - 1) * size_;
    }
    const Nearest nearest = find_nearest(index, centre, bounds);
    const float distance = std::sqrt(nearest.squared);
    Cells block_of_cells(first_cell, size_);
    if (distance > reach_ + block_radius) {
      std::fill_n(block_of_cells.place, block_cells, static_cast<std::int32_t>(nearest.place));
    } else {
      // Who is nearest to some cell's centre is at most distance + block_radius from it, and so at
      // most this far from the block's; with room for rounding.
      const float limit = (distance + 2 * block_radius) * 1.00001f;
      const float limit_squared = limit * limit;
      for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
        if (bounds[leaf] > limit_squared) continue;
        alignas(64) float squared[SpatialIndex::leaf_size];
        index.leaf_distances(leaf, centre[0], centre[1], centre[2], squared);
        for (Index i = 0; i < SpatialIndex::leaf_size; ++i) {
          const Index p = leaf * SpatialIndex::leaf_size + i;
          if (squared[i] > limit_squared) continue;
          block_of_cells.offer(points.x[p], points.y[p], points.z[p], static_cast<std::int32_t>(p));
        }
      }
    }
    for (Index i = 0; i < block_cells; ++i) {
      const Index x = corner[0] + i % block;
      const Index y = corner[1] + i / block % block;
      const Index z = corner[2] + i / (block * block);
      nearest_[static_cast<std::size_t>((z * counts_[1] + y) * counts_[0] + x)] =
          static_cast<std::uint16_t>(original[block_of_cells.place[i]]);
    }
  }
}

void NearestGrid::nearest(const Coordinates& queries, Index count,
                          std::uint16_t* places) const noexcept {
  constexpr Index most = 64;
  alignas(64) std::int32_t cell[most];
  for (Index first = 0; first < count; first += most) {
    const Index some = std::min(most, count - first);
    const float *x = queries.x + first, *y = queries.y + first, *z = queries.z + first;
#pragma omp simd
    for (Index i = 0; i < some; ++i) cell[i] = cell_of(x[i], y[i], z[i]);
    for (Index i = 0; i < some; ++i) {
      places[first + i] = nearest_[static_cast<std::size_t>(cell[i])];
    }
  }
}

}  // namespace vnreg::kernels
