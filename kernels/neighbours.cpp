#include "kernels/neighbours.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace vnreg::kernels {
namespace {

constexpr float largest = std::numeric_limits<float>::max();

struct Point {
  float x, y, z;
};

inline Point point_at(const Coordinates& c, Index i) noexcept { return {c.x[i], c.y[i], c.z[i]}; }

inline float distance(const Point& a, const Point& b) noexcept {
  const float dx = a.x - b.x;
  const float dy = a.y - b.y;
  const float dz = a.z - b.z;
  return std::sqrt((dx * dx + dy * dy) + dz * dz);
}

/// What the previous query's squared bound becomes at this one, `step` away: the triangle
/// inequality, with room for rounding (relative) and underflow (absolute).
inline float moved_bound(float squared, float step) noexcept {
  const float reach = std::sqrt(squared) + step;
  return std::min(reach * reach * 1.00001f + 1e-36f, largest);
}

/// Orders like (squared distance, index): non-negative floats compare as their bits do.
inline std::uint64_t key_of(float squared, std::uint32_t original) noexcept {
  return (std::uint64_t{std::bit_cast<std::uint32_t>(squared)} << 32) | original;
}

inline float squared_of(std::uint64_t key) noexcept {
  return std::bit_cast<float>(static_cast<std::uint32_t>(key >> 32));
}

/// Appends every point within `bound` to the scratch's candidates; returns how many there are.
Index collect(const SpatialIndex& index, const Point& q, float bound,
              NeighbourScratch& scratch) noexcept {
  const std::uint32_t* original = index.original();
  std::uint64_t* keys = scratch.keys.data();
  std::uint32_t* places = scratch.places.data();
  index.leaf_bounds(q.x, q.y, q.z, scratch.bounds.data());
  Index found = 0;
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    if (scratch.bounds[static_cast<std::size_t>(leaf)] > bound) continue;
    alignas(64) float squared[SpatialIndex::leaf_size];
    index.leaf_distances(leaf, q.x, q.y, q.z, squared);
    const Index first = leaf * SpatialIndex::leaf_size;
    for (Index i = 0; i < SpatialIndex::leaf_size; ++i) {  // append without a branch
      keys[found] = key_of(squared[i], original[first + i]);
      places[found] = static_cast<std::uint32_t>(first + i);
      found += squared[i] <= bound ? 1 : 0;
    }
  }
  return found;
}

/// The k-th smallest key of the candidates.
std::uint64_t kth_key(NeighbourScratch& scratch, Index found, Index k) noexcept {
  std::uint64_t* selected = scratch.selected.data();
  std::copy_n(scratch.keys.data(), found, selected);
  std::nth_element(selected, selected + (k - 1), selected + found);
  return selected[k - 1];
}

}  // namespace

NeighbourScratch::NeighbourScratch(Index max_points) {
  // One leaf of room: appending writes before it knows whether to keep.
  const auto room = static_cast<std::size_t>(max_points + 2 * SpatialIndex::leaf_size);
  bounds.resize(room / static_cast<std::size_t>(SpatialIndex::leaf_size) + 1);
  keys.resize(room);
  selected.resize(room);
  places.resize(room);
}

void mean_neighbour_offsets(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& scratch, float* offset_x, float* offset_y,
                            float* offset_z, float* spacing_squared) noexcept {
  const Coordinates points = index.ordered();
  // The nearest other point is wanted too, so at least two are searched.
  const Index wanted = std::min(std::max<Index>(k, 2), index.count());
  const Index first = first_leaf * SpatialIndex::leaf_size;
  const Index last = std::min(last_leaf * SpatialIndex::leaf_size, index.count());
  const float share = 1.0f / static_cast<float>(k);
  float reached = largest;  // the previous query's squared distance to its last wanted neighbour
  for (Index i = first; i < last; ++i) {
    const Point q = point_at(points, i);
    const float bound =
        i == first ? largest : moved_bound(reached, distance(q, point_at(points, i - 1)));
    const Index found = collect(index, q, bound, scratch);
    const std::uint64_t kth = kth_key(scratch, found, k);
    const auto own = index.original()[i];
    Point sum{0, 0, 0};
    float spacing = std::numeric_limits<float>::infinity();
    for (Index c = 0; c < found; ++c) {
      const std::uint64_t key = scratch.keys[static_cast<std::size_t>(c)];
      const bool is_self = static_cast<std::uint32_t>(key) == own;
      if (!is_self) spacing = std::min(spacing, squared_of(key));
      if (key > kth) continue;
      const Point n = point_at(points, scratch.places[static_cast<std::size_t>(c)]);
      sum = {sum.x + (n.x - q.x), sum.y + (n.y - q.y), sum.z + (n.z - q.z)};
    }
    offset_x[own] = sum.x * share;
    offset_y[own] = sum.y * share;
    offset_z[own] = sum.z * share;
    spacing_squared[own] = spacing;
    reached = wanted > k ? std::max(squared_of(kth), spacing) : squared_of(kth);
  }
}

void nearest_points(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, std::uint16_t* neighbours) noexcept {
  const Coordinates points = index.ordered();
  const Index first = first_leaf * SpatialIndex::leaf_size;
  const Index last = std::min(last_leaf * SpatialIndex::leaf_size, index.count());
  float reached = largest;  // the previous query's squared distance to its last neighbour
  for (Index i = first; i < last; ++i) {
    const Point q = point_at(points, i);
    const float bound =
        i == first ? largest : moved_bound(reached, distance(q, point_at(points, i - 1)));
    const Index found = collect(index, q, bound, scratch);
    const std::uint64_t kth = kth_key(scratch, found, k);
    std::uint16_t* own = neighbours + k * static_cast<Index>(index.original()[i]);
    for (Index c = 0; c < found; ++c) {
      const std::uint64_t key = scratch.keys[static_cast<std::size_t>(c)];
      if (key <= kth) *own++ = static_cast<std::uint16_t>(key);  // its low bits: the index
    }
    reached = squared_of(kth);
  }
}

void nearest_distances(const SpatialIndex& index, const Coordinates& queries, Index count,
                       NeighbourScratch& scratch, float* squared) noexcept {
  for (Index i = 0; i < count; ++i) {
    const Point q = point_at(queries, i);
    float nearest =
        i == 0 ? largest : moved_bound(squared[i - 1], distance(q, point_at(queries, i - 1)));
    index.leaf_bounds(q.x, q.y, q.z, scratch.bounds.data());
    for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
      if (scratch.bounds[static_cast<std::size_t>(leaf)] > nearest) continue;
      alignas(64) float distances[SpatialIndex::leaf_size];
      index.leaf_distances(leaf, q.x, q.y, q.z, distances);
      for (const float d : distances) nearest = d < nearest ? d : nearest;
    }
    squared[i] = nearest;
  }
}

}  // namespace vnreg::kernels
