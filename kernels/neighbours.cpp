#include "kernels/neighbours.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "kernels/list_within.hpp"

namespace vnreg::kernels {
namespace {

using Eigen::internal::padd;
using Eigen::internal::pcmp_eq;
using Eigen::internal::ploadu;
using Eigen::internal::plset;
using Eigen::internal::pmin;
using Eigen::internal::pmul;
using Eigen::internal::pselect;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;
using Eigen::internal::psub;

constexpr Index leaf_size = SpatialIndex::leaf_size;
constexpr float infinity = std::numeric_limits<float>::infinity();
// Behind all numbers of points.
constexpr std::int32_t no_point = std::numeric_limits<std::int32_t>::max();
// Of squared distances: how much farther than the limit of one point of a leaf to look for
// neighbours of the others. Less, and a denser point's candidates do not do for the next one; more,
// and there are too many.
constexpr float room_per_limit = 2.0f;

struct Point {
  float x, y, z;
};

inline Point point_at(const Coordinates& c, Index i) noexcept { return {c.x[i], c.y[i], c.z[i]}; }

/// Copies the leaves whose nearest bound is within `reach` behind each other.
void gather_leaves(const SpatialIndex& index, const Floats& bounds, float reach,
                   Candidates& out) noexcept {
  const Coordinates points = index.ordered();
  out.count = 0;
  for_each_listed(bounds.data(), index.leaves(), reach, [&](Index leaf) {
    const Index first = leaf * leaf_size;
    std::copy_n(points.x + first, leaf_size, out.x.data() + out.count);
    std::copy_n(points.y + first, leaf_size, out.y.data() + out.count);
    std::copy_n(points.z + first, leaf_size, out.z.data() + out.count);
    std::copy_n(index.original() + first, leaf_size, out.original.data() + out.count);
    out.count += leaf_size;
  });
}

/// Squared distances from the box, which no point in it is nearer than.
void measure_from_box(const Box& box, Candidates& c) noexcept {
  using Numbers = Eigen::Map<const Eigen::ArrayXf>;
  const auto outside = [&](const Floats& q, Index axis) {
    const Numbers along(q.data(), c.count);
    return (box.low[axis] - along).max(along - box.high[axis]).max(0.0f).square();
  };
  Eigen::Map<Eigen::ArrayXf>(c.squared.data(), c.count) =
      (outside(c.x, 0) + outside(c.y, 1)) + outside(c.z, 2);
}

/// Those of `all` that are at most `limit` from the box, in the same order; padding follows up to a
/// multiple of the leaf size.
void gather_near(const Box& box, float limit, Candidates& all, Candidates& near) noexcept {
  measure_from_box(box, all);
  std::size_t count = 0;
  const auto add = [&](float x, float y, float z, std::int32_t original) {
    near.x[count] = x;
    near.y[count] = y;
    near.z[count] = z;
    near.original[count++] = original;
  };
  for_each_within(all.squared.data(), all.count, limit, [&](Index i) {
    const auto at = static_cast<std::size_t>(i);
    add(all.x[at], all.y[at], all.z[at], all.original[at]);
  });
  constexpr float far = SpatialIndex::beyond;
  while (count % leaf_size != 0) add(far, far, far, no_point);
  near.count = static_cast<Index>(count);
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

/// Squared distances from q.
void measure(const Point& q, Candidates& c) noexcept {
  const float* x = c.x.data();
  const float* y = c.y.data();
  const float* z = c.z.data();
  float* squared = c.squared.data();
#pragma omp simd
  for (Index i = 0; i < c.count; ++i) {
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

// Smallest distances are taken by their bits, which are ordered like numbers from 0 on: OpenMP's
// least float32 starts at the largest finite number with some compilers and at infinity with
// others.
std::int32_t bits_of(float squared) noexcept { return std::bit_cast<std::int32_t>(squared); }

/// The smallest distance above `limit`, or infinity.
float next_above(const float* squared, Index count, float limit) noexcept {
  std::int32_t next = bits_of(infinity);
#pragma omp simd reduction(min : next)
  for (Index i = 0; i < count; ++i) {
    // NOLINTNEXTLINE(bugprone-narrowing-conversions): from float to float, it says itself.
    const std::int32_t candidate = bits_of(squared[i] > limit ? squared[i] : infinity);
    next = candidate < next ? candidate : next;
  }
  return std::bit_cast<float>(next);
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

Selection select_nearest(std::int32_t k, float guess, const Candidates& c,
                         std::int32_t* tied) noexcept {
  const float* squared = c.squared.data();
  const float limit = limit_of_nearest(squared, c.count, k, guess);
  const std::int32_t surplus = count_within(squared, c.count, limit) - k;
  if (surplus == 0) return {limit, no_point};
  Index ties = 0;
  for (Index i = 0; i < c.count; ++i) {
    if (squared[i] == limit) tied[ties++] = c.original[static_cast<std::size_t>(i)];
  }
  std::int32_t* last = tied + (ties - surplus - 1);
  std::nth_element(tied, last, tied + ties);
  return {limit, *last};
}

/// Calls use(i, candidates, selection) for every point i of the order in the leaves; among the
/// candidates is its neighbourhood.
///
/// The points of one leaf share two sets of candidates: `all` for certain, and the few that are
/// nearer to the leaf than `room`. What is found among these within `room` is found for certain.
template <class Use>
void for_each_neighbourhood(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& s, const Use& use) noexcept {
  const Coordinates points = index.ordered();
  const auto number = static_cast<std::int32_t>(k);
  // Two at least, so that the nearest other point is always among the candidates.
  const Index wanted = std::min(std::max<Index>(k, 2), index.count());
  for (Index leaf = first_leaf; leaf < last_leaf; ++leaf) {
    const float reach = reach_of(index, leaf, wanted, s);
    gather_leaves(index, s.bounds, reach, s.all);
    s.near.count = 0;
    float room = -1.0f;
    float guess = 0.25f * reach;
    for (Index i = leaf * leaf_size; i < std::min((leaf + 1) * leaf_size, index.count()); ++i) {
      if (s.near.count >= wanted) {
        measure(point_at(points, i), s.near);
        const Selection nearest = select_nearest(number, guess, s.near, s.tied.data());
        if (nearest.limit <= room) {
          guess = nearest.limit;
          use(i, s.near, nearest);
          continue;
        }
      }
      measure(point_at(points, i), s.all);
      const Selection nearest = select_nearest(number, guess, s.all, s.tied.data());
      guess = nearest.limit;
      use(i, s.all, nearest);
      if (k < wanted) continue;  // the nearest other point may be farther than the k nearest
      room = room_per_limit * nearest.limit;
      gather_near(index.box(leaf), room, s.all, s.near);
    }
  }
}

/// Sum of x_j - q over the selected points.
Point sum_offsets(const Point& q, const Selection& nearest, const Candidates& c) noexcept {
  const float* x = c.x.data();
  const float* y = c.y.data();
  const float* z = c.z.data();
  const float* squared = c.squared.data();
  const std::int32_t* original = c.original.data();
  float sum_x = 0, sum_y = 0, sum_z = 0;
#pragma omp simd reduction(+ : sum_x, sum_y, sum_z)
  for (Index i = 0; i < c.count; ++i) {
    const bool closer = squared[i] < nearest.limit;
    const bool tied = squared[i] == nearest.limit;
    const bool selected = closer | (tied & (original[i] <= nearest.last_tied));
    sum_x += selected ? x[i] - q.x : 0.0f;
    sum_y += selected ? y[i] - q.y : 0.0f;
    sum_z += selected ? z[i] - q.z : 0.0f;
  }
  return {sum_x, sum_y, sum_z};
}

/// The smallest distance to a point other than `own`, or infinity.
float nearest_other(std::int32_t own, const Candidates& c) noexcept {
  const float* squared = c.squared.data();
  const std::int32_t* original = c.original.data();
  std::int32_t nearest = bits_of(infinity);
#pragma omp simd reduction(min : nearest)
  for (Index i = 0; i < c.count; ++i) {
    // NOLINTNEXTLINE(bugprone-narrowing-conversions): from float to float, it says itself.
    const std::int32_t candidate = bits_of(original[i] == own ? infinity : squared[i]);
    nearest = candidate < nearest ? candidate : nearest;
  }
  return std::bit_cast<float>(nearest);
}

/// For each point of a leaf the smallest squared distance to the points offered.
struct NearestOfLeaf {
  static constexpr Index packets = leaf_size / packet_size;
  static_assert(leaf_size % packet_size == 0);
  Packet x[packets], y[packets], z[packets], squared[packets];

  NearestOfLeaf(const Coordinates& points, Index leaf) noexcept {
    for (Index i = 0; i < packets; ++i) {
      const Index at = leaf * leaf_size + i * packet_size;
      x[i] = ploadu<Packet>(points.x + at);
      y[i] = ploadu<Packet>(points.y + at);
      z[i] = ploadu<Packet>(points.z + at);
      squared[i] = pset1<Packet>(infinity);
    }
  }

  void offer(const Point& p) noexcept {
    for (Index i = 0; i < packets; ++i) squared[i] = pmin(squared[i], squared_distance(p, i));
  }

  /// To all but the point of the leaf whose number (from 0) it is.
  void offer_own(const Point& p, Index number) noexcept {
    for (Index i = 0; i < packets; ++i) {
      const Packet lane = plset<Packet>(static_cast<float>(i * packet_size));
      const Packet self = pcmp_eq(lane, pset1<Packet>(static_cast<float>(number)));
      const Packet other = pselect(self, pset1<Packet>(infinity), squared_distance(p, i));
      squared[i] = pmin(squared[i], other);
    }
  }

  void store(float* nearest) const noexcept {
    for (Index i = 0; i < packets; ++i) pstoreu(nearest + i * packet_size, squared[i]);
  }

 private:
  Packet squared_distance(const Point& p, Index i) const noexcept {
    const Packet dx = psub(x[i], pset1<Packet>(p.x));
    const Packet dy = psub(y[i], pset1<Packet>(p.y));
    const Packet dz = psub(z[i], pset1<Packet>(p.z));
    return padd(padd(pmul(dx, dx), pmul(dy, dy)), pmul(dz, dz));
  }
};

/// Calls use(i) for every query: then s.all holds the points among which is the nearest one, and
/// their distances from it.
template <class Use>
void for_each_query(const SpatialIndex& index, const Coordinates& queries, Index count,
                    NeighbourScratch& s, const Use& use) noexcept {
  for (Index first = 0; first < count; first += leaf_size) {
    const Index group = std::min(leaf_size, count - first);
    const Box box = box_of({queries.x + first, queries.y + first, queries.z + first}, group);
    index.box_bounds(box, s.bounds.data(), s.far_bounds.data());
    const float* far_bounds = s.far_bounds.data();
    gather_leaves(index, s.bounds, *std::min_element(far_bounds, far_bounds + index.leaves()),
                  s.all);
    for (Index i = first; i < first + group; ++i) {
      measure(point_at(queries, i), s.all);
      use(i);
    }
  }
}

/// The lowest number of the points at that distance.
std::int32_t first_at(float distance, const Candidates& c) noexcept {
  const float* squared = c.squared.data();
  const std::int32_t* original = c.original.data();
  std::int32_t first = no_point;
#pragma omp simd reduction(min : first)
  for (Index i = 0; i < c.count; ++i) {
    const std::int32_t candidate = squared[i] == distance ? original[i] : no_point;
    first = candidate < first ? candidate : first;
  }
  return first;
}

}  // namespace

Candidates::Candidates(std::size_t points) : original(points) {
  for (Floats* array : {&x, &y, &z, &squared}) array->resize(points);
}

NeighbourScratch::NeighbourScratch(Index max_points) {
  const auto leaves = static_cast<std::size_t>((max_points + leaf_size - 1) / leaf_size);
  const std::size_t points = leaves * static_cast<std::size_t>(leaf_size);
  for (Floats* array : {&bounds, &far_bounds}) array->resize(leaves);
  all = Candidates(points);
  near = Candidates(points);
  tied.resize(points);
}

void mean_neighbour_offsets(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                            NeighbourScratch& scratch, float* offset_x, float* offset_y,
                            float* offset_z, float* spacing_squared) noexcept {
  const float share = 1.0f / static_cast<float>(k);
  for_each_neighbourhood(
      index, k, first_leaf, last_leaf, scratch,
      [&](Index i, const Candidates& candidates, const Selection& nearest) {
        const std::uint32_t own = index.original()[i];
        const Point sum = sum_offsets(point_at(index.ordered(), i), nearest, candidates);
        offset_x[own] = sum.x * share;
        offset_y[own] = sum.y * share;
        offset_z[own] = sum.z * share;
        spacing_squared[own] = nearest_other(static_cast<std::int32_t>(own), candidates);
      });
}

void nearest_points(const SpatialIndex& index, Index k, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, std::uint16_t* neighbours) noexcept {
  for_each_neighbourhood(index, k, first_leaf, last_leaf, scratch,
                         [&](Index i, const Candidates& candidates, const Selection& nearest) {
                           std::uint16_t* out = neighbours + k * Index{index.original()[i]};
                           const float* squared = candidates.squared.data();
                           for_each_within(squared, candidates.count, nearest.limit, [&](Index c) {
                             const std::int32_t at =
                                 candidates.original[static_cast<std::size_t>(c)];
                             const bool tied = squared[c] == nearest.limit;
                             if (!tied || at <= nearest.last_tied)
                               *out++ = static_cast<std::uint16_t>(at);
                           });
                         });
}

void nearest_others(const SpatialIndex& index, Index first_leaf, Index last_leaf,
                    NeighbourScratch& scratch, float* squared) noexcept {
  const Coordinates points = index.ordered();
  float* bounds = scratch.bounds.data();
  for (Index leaf = first_leaf; leaf < last_leaf; ++leaf) {
    const Index first = leaf * leaf_size;
    const Index count = std::min(leaf_size, index.count() - first);
    NearestOfLeaf leaf_points(points, leaf);
    for (Index i = 0; i < count; ++i) leaf_points.offer_own(point_at(points, first + i), i);
    alignas(64) float nearest[leaf_size];
    leaf_points.store(nearest);
    const float limit = *std::max_element(nearest, nearest + count);
    index.box_bounds(index.box(leaf), bounds, scratch.far_bounds.data());
    for_each_listed(bounds, index.leaves(), limit, [&](Index other) {
      if (other == leaf) return;
      const Index from = other * leaf_size;
      for (Index i = from; i < std::min(from + leaf_size, index.count()); ++i) {
        leaf_points.offer(point_at(points, i));
      }
    });
    leaf_points.store(nearest);
    for (Index i = 0; i < count; ++i) squared[index.original()[first + i]] = nearest[i];
  }
}

void nearest_distances(const SpatialIndex& index, const Coordinates& queries, Index count,
                       NeighbourScratch& scratch, float* squared) noexcept {
  for_each_query(index, queries, count, scratch, [&](Index i) {
    squared[i] = next_above(scratch.all.squared.data(), scratch.all.count, -1.0f);
  });
}

void nearest_places(const SpatialIndex& index, const Coordinates& queries, Index count,
                    NeighbourScratch& scratch, std::uint16_t* places) noexcept {
  for_each_query(index, queries, count, scratch, [&](Index i) {
    const float least = next_above(scratch.all.squared.data(), scratch.all.count, -1.0f);
    places[i] = static_cast<std::uint16_t>(first_at(least, scratch.all));
  });
}

}  // namespace vnreg::kernels
