// Neighbours by comparing every point with every other. For tests.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels::reference {

/// (dx*dx + dy*dy) + dz*dz in float32; volatile, so that no build fuses the operations.
inline float squared_distance(const Coordinates& a, Index i, const Coordinates& b, Index j) {
  const float dx = a.x[i] - b.x[j];
  const float dy = a.y[i] - b.y[j];
  const float dz = a.z[i] - b.z[j];
  const volatile float xx = dx * dx;
  const volatile float yy = dy * dy;
  const volatile float zz = dz * dz;
  const volatile float xy = xx + yy;
  return xy + zz;
}

/// All points by distance from point i, ties by index.
inline std::vector<Index> by_distance(const Coordinates& points, Index count, Index i) {
  std::vector<float> distance(static_cast<std::size_t>(count));
  for (Index j = 0; j < count; ++j) {
    distance[static_cast<std::size_t>(j)] = squared_distance(points, j, points, i);
  }
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return distance[static_cast<std::size_t>(a)] < distance[static_cast<std::size_t>(b)];
  });
  return order;
}

/// Squared distance from point i to the nearest other point; infinite when it is alone.
inline float spacing_squared(const Coordinates& points, Index count, Index i) {
  float nearest = std::numeric_limits<float>::infinity();
  for (Index j = 0; j < count; ++j) {
    if (j != i) nearest = std::min(nearest, squared_distance(points, j, points, i));
  }
  return nearest;
}

inline float nearest_distance(const Coordinates& points, Index count, const Coordinates& queries,
                              Index q) {
  float nearest = std::numeric_limits<float>::infinity();
  for (Index j = 0; j < count; ++j) {
    nearest = std::min(nearest, squared_distance(points, j, queries, q));
  }
  return nearest;
}

/// The point nearest to the query, of equally near ones the first.
inline Index nearest_place(const Coordinates& points, Index count, const Coordinates& queries,
                           Index q) {
  Index nearest = 0;
  for (Index j = 1; j < count; ++j) {
    if (squared_distance(points, j, queries, q) < squared_distance(points, nearest, queries, q)) {
      nearest = j;
    }
  }
  return nearest;
}

}  // namespace vnreg::kernels::reference
