// Exact nearest neighbours on a SpatialIndex.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

/// Points that may be near to the queries at hand: a multiple of the leaf size.
struct Candidates {
  Index count = 0;
  Floats x, y, z;
  std::vector<std::int32_t> original;  // places in the input
  Floats squared;                      // distances from one query

  Candidates() = default;
  explicit Candidates(std::size_t points);
};

/// Working memory of one thread.
struct NeighbourScratch {
  Floats bounds, far_bounds;       // one per leaf
  Candidates all;                  // whole leaves
  Candidates near;                 // of these, the points near to all queries
  std::vector<std::int32_t> tied;  // those at the distance of the k-th nearest

  NeighbourScratch() = default;
  explicit NeighbourScratch(Index max_points);
};

/// For each point i of the leaves [first_leaf, last_leaf): the mean of x_j - x_i over its k nearest
/// points j, i included (1 <= k <= count; equal distances: the lower index first), and the squared
/// distance to the nearest point other than i itself (infinite when there is none). Outputs are
/// indexed like the input points.
void mean_neighbour_offsets(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& scratch, float* offset_x, float* offset_y,
                            float* offset_z, float* spacing_squared) noexcept;

/// neighbours[k * i + n], n = 0..k-1: the k points nearest to input point i of those leaves, itself
/// included, in no particular order (1 <= k <= count; equal distances: the lower index first).
void nearest_points(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, std::uint16_t* neighbours) noexcept;

/// squared[i] = squared distance from input point i of those leaves to the nearest other point,
/// infinite when there is none.
void nearest_others(const SpatialIndex& index, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, float* squared) noexcept;

/// places[i] = the place in the input of the point nearest to query i, of equally near ones the
/// lowest. For indices of at most 65,536 points; fast like nearest_distances().
void nearest_places(const SpatialIndex& index, const Coordinates& queries, Index count,
                    NeighbourScratch& scratch, std::uint16_t* places) noexcept;

/// squared[i] = squared distance from query i to the nearest point of the index. Fast when
/// consecutive queries are near each other, as in the order of another index.
void nearest_distances(const SpatialIndex& index, const Coordinates& queries, Index count,
                       NeighbourScratch& scratch, float* squared) noexcept;

}  // namespace vnreg::kernels
