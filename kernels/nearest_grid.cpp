#include "kernels/nearest_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/list_within.hpp"

namespace vnreg::kernels {
namespace {

constexpr Index part = NearestGrid::part;
constexpr Index part_cells = part * part * part;
constexpr float infinity = std::numeric_limits<float>::infinity();

/// From the centre of a cube of `side` cells to the farthest centre of its cells.
float radius_of(Index side, float size) noexcept {
  return std::sqrt(3.0f) * 0.5f * static_cast<float>(side - 1) * size;
}

/// Squared distances from q to the first `count` points of the scratch; returns the least.
float measure(const float q[3], Index count, const NeighbourScratch& s, float* squared) noexcept {
  const float qx = q[0], qy = q[1], qz = q[2];
  const float *x = s.x.data(), *y = s.y.data(), *z = s.z.data();
  float least = infinity;
#pragma omp simd reduction(min : least)
  for (Index i = 0; i < count; ++i) {
    const float dx = x[i] - qx, dy = y[i] - qy, dz = z[i] - qz;
    squared[i] = (dx * dx + dy * dy) + dz * dz;
    least = squared[i] < least ? squared[i] : least;
  }
  return least;
}

/// The squared distance from q to the nearest point. Leaves the bounds of all leaves in `bounds`.
float nearest_distance(const SpatialIndex& index, const float q[3], float* bounds) noexcept {
  index.leaf_bounds(q[0], q[1], q[2], bounds);
  const auto within = [&](Index leaf) {
    alignas(64) float squared[SpatialIndex::leaf_size];
    index.leaf_distances(leaf, q[0], q[1], q[2], squared);
    return *std::min_element(squared, squared + SpatialIndex::leaf_size);
  };
  const Index start = std::min_element(bounds, bounds + index.leaves()) - bounds;
  float least = within(start);
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    if (bounds[leaf] < least && leaf != start) least = std::min(least, within(leaf));
  }
  return least;
}

/// Copies the leaves that may hold points within `limit_squared`; returns their number of points,
/// a multiple of the leaf size.
Index gather_candidates(const SpatialIndex& index, float limit_squared,
                        NeighbourScratch& s) noexcept {
  constexpr Index leaf_size = SpatialIndex::leaf_size;
  const Coordinates points = index.ordered();
  Index count = 0;
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    if (s.bounds[static_cast<std::size_t>(leaf)] > limit_squared) continue;
    const Index first = leaf * leaf_size;
    std::copy_n(points.x + first, leaf_size, s.x.data() + count);
    std::copy_n(points.y + first, leaf_size, s.y.data() + count);
    std::copy_n(points.z + first, leaf_size, s.z.data() + count);
    std::copy_n(index.original() + first, leaf_size, s.original.data() + count);
    count += leaf_size;
  }
  return count;
}

/// The centres of a part's cells and what is nearest to them so far.
struct Cells {
  alignas(64) float x[part_cells], y[part_cells], z[part_cells];
  alignas(64) float squared[part_cells];
  alignas(64) std::int32_t point[part_cells];

  Cells(const float first_centre[3], float size) noexcept {
    for (Index i = 0; i < part_cells; ++i) {
      x[i] = first_centre[0] + size * static_cast<float>(i % part);
      y[i] = first_centre[1] + size * static_cast<float>(i / part % part);
      z[i] = first_centre[2] + size * static_cast<float>(i / (part * part));
    }
    std::fill_n(squared, part_cells, infinity);
    std::fill_n(point, part_cells, 0);
  }

  void offer(float px, float py, float pz, std::int32_t candidate) noexcept {
#pragma omp simd
    for (Index i = 0; i < part_cells; ++i) {
      const float dx = px - x[i], dy = py - y[i], dz = pz - z[i];
      const float distance = (dx * dx + dy * dy) + dz * dz;
      const bool nearer = distance < squared[i];
      squared[i] = nearer ? distance : squared[i];
      point[i] = nearer ? candidate : point[i];
    }
  }
};

/// Who is nearest to the centre of some cell of a cube is at most `distance` + `radius` from it,
/// and so at most this far from the cube's centre; with room for rounding.
float candidates_limit(float distance, float radius) noexcept {
  const float limit = (distance + 2 * radius) * 1.00001f;
  return limit * limit;
}

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
  const Index blocks_x = counts_[0] / block;
  const Index blocks_y = counts_[1] / block;
  for (Index b = first; b < last; ++b) {
    const Index corner[3] = {b % blocks_x * block, b / blocks_x % blocks_y * block,
                             b / (blocks_x * blocks_y) * block};
    fill_block(index, corner, scratch);
  }
}

void NearestGrid::fill_block(const SpatialIndex& index, const Index corner[3],
                             NeighbourScratch& scratch) noexcept {
  const float radius = radius_of(block, size_);
  float middle[3];
  for (int axis = 0; axis < 3; ++axis) {
    middle[axis] = centre(axis, corner[axis]) + 0.5f * static_cast<float>(block - 1) * size_;
  }
  const float nearest = nearest_distance(index, middle, scratch.bounds.data());
  const float distance = std::sqrt(nearest);
  const bool far = distance > reach_ + radius;
  const float limit = far ? nearest * 1.00001f : candidates_limit(distance, radius);
  const Index count = gather_candidates(index, limit, scratch);
  float* squared = scratch.squared.data();
  if (far) {
    const float least = measure(middle, count, scratch, squared);
    const auto found = std::find(squared, squared + count, least) - squared;
    store(corner, block, scratch.original.data() + found, 0);
    return;
  }
  for (Index i = 0; i < block * block * block; i += part_cells) {
    constexpr Index parts = block / part;
    const Index p = i / part_cells;
    const Index part_corner[3] = {corner[0] + p % parts * part,
                                  corner[1] + p / parts % parts * part,
                                  corner[2] + p / (parts * parts) * part};
    fill_part(scratch, count, part_corner, squared);
  }
}

void NearestGrid::fill_part(const NeighbourScratch& candidates, Index count, const Index corner[3],
                            float* squared) noexcept {
  const float radius = radius_of(part, size_);
  float first_centre[3], middle[3];
  for (int axis = 0; axis < 3; ++axis) {
    first_centre[axis] = centre(axis, corner[axis]);
    middle[axis] = first_centre[axis] + 0.5f * static_cast<float>(part - 1) * size_;
  }
  const float nearest = measure(middle, count, candidates, squared);
  const float distance = std::sqrt(nearest);
  const bool far = distance > reach_ + radius;
  Cells held(first_centre, size_);
  for_each_within(squared, count, far ? nearest : candidates_limit(distance, radius), [&](Index i) {
    const auto at = static_cast<std::size_t>(i);
    held.offer(candidates.x[at], candidates.y[at], candidates.z[at], candidates.original[at]);
  });
  store(corner, part, held.point, 1);
}

/// Cell i of a cube takes points[i * step].
void NearestGrid::store(const Index corner[3], Index side, const std::int32_t* points,
                        Index step) noexcept {
  for (Index i = 0; i < side * side * side; ++i) {
    const Index x = corner[0] + i % side;
    const Index y = corner[1] + i / side % side;
    const Index z = corner[2] + i / (side * side);
    nearest_[static_cast<std::size_t>((z * counts_[1] + y) * counts_[0] + x)] =
        static_cast<std::uint16_t>(points[i * step]);
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
