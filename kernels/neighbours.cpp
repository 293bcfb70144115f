#include "kernels/neighbours.hpp"

#include <algorithm>
#include <limits>

#include "kernels/list_within.hpp"

namespace vnreg::kernels {
namespace {

constexpr Index leaf_size = SpatialIndex::leaf_size;
constexpr float infinity = std::numeric_limits<float>::infinity();

struct Point {
  float x, y, z;
};

inline Point point_at(const Coordinates& c, Index i) noexcept { return {c.x[i], c.y[i], c.z[i]}; }

/// Copies the leaves whose nearest bound is within `reach` behind each other; returns the number of
/// points, a multiple of the leaf size.
Index gather_leaves(const SpatialIndex& index, float reach, NeighbourScratch& s) noexcept {
  const Coordinates points = index.ordered();
  Index count = 0;
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    if (s.bounds[static_cast<std::size_t>(leaf)] > reach) continue;
    const Index first = leaf * leaf_size;
    std::copy_n(points.x + first, leaf_size, s.x.data() + count);
    std::copy_n(points.y + first, leaf_size, s.y.data() + count);
    std::copy_n(points.z + first, leaf_size, s.z.data() + count);
    std::copy_n(index.original() + first, leaf_size, s.original.data() + count);
    count += leaf_size;
  }
  return count;
}

/// A squared distance within which every point of `leaf` has at least `wanted` points: the smallest
/// that a run of leaves around it grants. Leaves the bounds of all leaves in the scratch.
float reach_of(const SpatialIndex& index, Index leaf, Index wanted, NeighbourScratch& s) noexcept {
  index.box_bounds(index.box(leaf), s.bounds.data(), s.far_bounds.data());
  const Index run = (wanted + leaf_size - 1) / leaf_size;
  float reach = infinity;
  for (Index first = std::max<Index>(0, leaf - run); first <= leaf; ++first) {
    Index last = std::min(first + run, index.leaves());
    if (std::min(last * leaf_size, index.count()) - first * leaf_size < wanted) ++last;
    if (last > index.leaves()) break;  // the last leaf may be partly filled
    const float* bounds = s.far_bounds.data();
    reach = std::min(reach, *std::max_element(bounds + first, bounds + last));
  }
  return reach;
}

void measure(const Point& q, Index count, NeighbourScratch& s) noexcept {
  const float* x = s.x.data();
  const float* y = s.y.data();
  const float* z = s.z.data();
  float* squared = s.squared.data();
#pragma omp simd
  for (Index i = 0; i < count; ++i) {
    const float dx = x[i] - q.x;
    const float dy = y[i] - q.y;
    const float dz = z[i] - q.z;
    squared[i] = (dx * dx + dy * dy) + dz * dz;
  }
}

std::int32_t count_within(const float* squared, Index count, float limit) noexcept {
  std::int32_t within = 0;
#pragma omp simd reduction(+ : within)
  for (Index i = 0; i < count; ++i) within += squared[i] <= limit ? 1 : 0;
  return within;
}

/// The smallest distance above `limit`.
float next_above(const float* squared, Index count, float limit) noexcept {
  float next = infinity;
#pragma omp simd reduction(min : next)
  for (Index i = 0; i < count; ++i) {
    const float candidate = squared[i] > limit ? squared[i] : infinity;
    next = candidate < next ? candidate : next;
  }
  return next;
}

/// The k nearest: all points closer than `limit`, and of those at `limit` the ones whose index is
/// at most `last_tied`.
struct Selection {
  float limit;
  std::int32_t last_tied;
};

/// On a surface the number of points grows with the squared distance, so a few proportional steps
/// come near k; then distances are taken one by one. `guess` > 0 starts the steps.
float limit_of_nearest(const float* squared, Index count, std::int32_t k, float guess) noexcept {
  float below = -1.0f;  // fewer than k points are within it
  float limit = guess;
  for (int step = 0; step < 4; ++step) {
    const std::int32_t within = count_within(squared, count, limit);
    if (within == k) return limit;
    if (within < k) below = std::max(below, limit);
    limit *= (static_cast<float>(k) + 0.25f) / (static_cast<float>(within) + 0.25f);
    if (!(limit > below)) break;
  }
  do {
    below = next_above(squared, count, below);
  } while (count_within(squared, count, below) < k);
  return below;
}

Selection select_nearest(Index count, std::int32_t k, float guess, NeighbourScratch& s) noexcept {
  const float* squared = s.squared.data();
  const float limit = limit_of_nearest(squared, count, k, guess);
  constexpr std::int32_t all = std::numeric_limits<std::int32_t>::max();
  const std::int32_t surplus = count_within(squared, count, limit) - k;
  if (surplus == 0) return {limit, all};
  std::int32_t* tied = s.tied.data();
  Index ties = 0;
  for (Index i = 0; i < count; ++i) {
    if (squared[i] == limit) tied[ties++] = s.original[static_cast<std::size_t>(i)];
  }
  std::int32_t* last = tied + (ties - surplus - 1);
  std::nth_element(tied, last, tied + ties);
  return {limit, *last};
}

/// Calls use(i, count, selection) for every point i of the order in the leaves: then the first
/// `count` points of the scratch hold the neighbourhood of i.
template <class Use>
void for_each_neighbourhood(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& s, const Use& use) noexcept {
  const Coordinates points = index.ordered();
  // Two at least, so that the nearest other point is always among the candidates.
  const Index wanted = std::min(std::max<Index>(k, 2), index.count());
  for (Index leaf = first_leaf; leaf < last_leaf; ++leaf) {
    const float reach = reach_of(index, leaf, wanted, s);
    const Index count = gather_leaves(index, reach, s);
    const Index last = std::min((leaf + 1) * leaf_size, index.count());
    float guess = 0.25f * reach;
    for (Index i = leaf * leaf_size; i < last; ++i) {
      measure(point_at(points, i), count, s);
      const Selection nearest = select_nearest(count, static_cast<std::int32_t>(k), guess, s);
      guess = nearest.limit;
      use(i, count, nearest);
    }
  }
}

/// Sum of x_j - q over the selected points.
Point sum_offsets(const Point& q, Index count, const Selection& nearest,
                  const NeighbourScratch& s) noexcept {
  const float* x = s.x.data();
  const float* y = s.y.data();
  const float* z = s.z.data();
  const float* squared = s.squared.data();
  const std::int32_t* original = s.original.data();
  float sum_x = 0, sum_y = 0, sum_z = 0;
#pragma omp simd reduction(+ : sum_x, sum_y, sum_z)
  for (Index i = 0; i < count; ++i) {
    const bool closer = squared[i] < nearest.limit;
    const bool tied = squared[i] == nearest.limit;
    const bool selected = closer | (tied & (original[i] <= nearest.last_tied));
    sum_x += selected ? x[i] - q.x : 0.0f;
    sum_y += selected ? y[i] - q.y : 0.0f;
    sum_z += selected ? z[i] - q.z : 0.0f;
  }
  return {sum_x, sum_y, sum_z};
}

/// The smallest distance to a point other than `own`.
float nearest_other(std::int32_t own, Index count, const NeighbourScratch& s) noexcept {
  const float* squared = s.squared.data();
  const std::int32_t* original = s.original.data();
  float nearest = infinity;
#pragma omp simd reduction(min : nearest)
  for (Index i = 0; i < count; ++i) {
    const float candidate = original[i] == own ? infinity : squared[i];
    nearest = candidate < nearest ? candidate : nearest;
  }
  return nearest;
}

/// nearest[i] = the smallest squared distance from point i of a leaf to a point of `offered`, or to
/// itself in `nearest`; no point is offered to itself.
void offer_leaf(const SpatialIndex& index, Index offered, Index leaf, float* nearest) noexcept {
  const Coordinates points = index.ordered();
  const float* x = points.x + leaf * leaf_size;
  const float* y = points.y + leaf * leaf_size;
  const float* z = points.z + leaf * leaf_size;
  const Index first = offered * leaf_size;
  const Index count = std::min(leaf_size, index.count() - first);
  for (Index j = 0; j < count; ++j) {
    const Point p = point_at(points, first + j);
    const auto self = static_cast<std::int32_t>(offered == leaf ? j : leaf_size);
#pragma omp simd
    for (std::int32_t i = 0; i < leaf_size; ++i) {
      const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
      const float squared = i == self ? infinity : (dx * dx + dy * dy) + dz * dz;
      nearest[i] = squared < nearest[i] ? squared : nearest[i];
    }
  }
}

}  // namespace

NeighbourScratch::NeighbourScratch(Index max_points) {
  const auto leaves = static_cast<std::size_t>((max_points + leaf_size - 1) / leaf_size);
  const std::size_t points = leaves * static_cast<std::size_t>(leaf_size);
  for (Floats* array : {&bounds, &far_bounds}) array->resize(leaves);
  for (Floats* array : {&x, &y, &z, &squared}) array->resize(points);
  original.resize(points);
  tied.resize(points);
}

void mean_neighbour_offsets(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& scratch, float* offset_x, float* offset_y,
                            float* offset_z, float* spacing_squared) noexcept {
  const float share = 1.0f / static_cast<float>(k);
  for_each_neighbourhood(
      index, k, first_leaf, last_leaf, scratch,
      [&](Index i, Index count, const Selection& nearest) {
        const std::uint32_t own = index.original()[i];
        const Point sum = sum_offsets(point_at(index.ordered(), i), count, nearest, scratch);
        offset_x[own] = sum.x * share;
        offset_y[own] = sum.y * share;
        offset_z[own] = sum.z * share;
        spacing_squared[own] = nearest_other(static_cast<std::int32_t>(own), count, scratch);
      });
}

void nearest_points(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, std::uint16_t* neighbours) noexcept {
  for_each_neighbourhood(
      index, k, first_leaf, last_leaf, scratch,
      [&](Index i, Index count, const Selection& nearest) {
        std::uint16_t* out = neighbours + k * Index{index.original()[i]};
        for_each_within(scratch.squared.data(), count, nearest.limit, [&](Index c) {
          const std::int32_t at = scratch.original[static_cast<std::size_t>(c)];
          const bool tied = scratch.squared[static_cast<std::size_t>(c)] == nearest.limit;
          if (!tied || at <= nearest.last_tied) *out++ = static_cast<std::uint16_t>(at);
        });
      });
}

void nearest_others(const SpatialIndex& index, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, float* squared) noexcept {
  float* bounds = scratch.bounds.data();
  for (Index leaf = first_leaf; leaf < last_leaf; ++leaf) {
    alignas(64) float nearest[leaf_size];
    std::fill_n(nearest, leaf_size, infinity);
    offer_leaf(index, leaf, leaf, nearest);
    const Index first = leaf * leaf_size;
    const Index count = std::min(leaf_size, index.count() - first);
    const float limit = *std::max_element(nearest, nearest + count);
    index.box_bounds(index.box(leaf), bounds, scratch.far_bounds.data());
    for (Index other = 0; other < index.leaves(); ++other) {
      if (bounds[other] <= limit && other != leaf) offer_leaf(index, other, leaf, nearest);
    }
    for (Index i = 0; i < count; ++i) squared[index.original()[first + i]] = nearest[i];
  }
}

void nearest_distances(const SpatialIndex& index, const Coordinates& queries, Index count,
                       NeighbourScratch& scratch, float* squared) noexcept {
  for (Index first = 0; first < count; first += leaf_size) {
    const Index group = std::min(leaf_size, count - first);
    const Box box = box_of({queries.x + first, queries.y + first, queries.z + first}, group);
    index.box_bounds(box, scratch.bounds.data(), scratch.far_bounds.data());
    const float* far_bounds = scratch.far_bounds.data();
    const float reach = *std::min_element(far_bounds, far_bounds + index.leaves());
    const Index candidates = gather_leaves(index, reach, scratch);
    for (Index i = first; i < first + group; ++i) {
      measure(point_at(queries, i), candidates, scratch);
      squared[i] = next_above(scratch.squared.data(), candidates, -1.0f);
    }
  }
}

}  // namespace vnreg::kernels
