// Kernels on points: spatial order, neighbours, moments, sums over neighbourhoods. Argument:
// points.
//
// A search is counted as the work that its own bounds leave: for every query the box bounds of all
// leaves, and the distances in those leaves that could hold a neighbour. That is what an exact
// search on this index has to do; time for ordering, selection and collection shows as the rest.
#include <algorithm>
#include <numeric>
#include <random>

#include "kernels/collect.hpp"
#include "kernels/list_within.hpp"
#include "kernels/moments.hpp"
#include "kernels/nearest_grid.hpp"
#include "kernels/neighbours.hpp"
#include "kernels/operands.hpp"
#include "kernels/oriented_points.hpp"
#include "kernels/surroundings.hpp"
#include "roofline.hpp"

namespace vnreg::bench {
namespace {

using namespace kernels;

constexpr double distance_flops = 8;    // three differences, three squares, two sums
constexpr double box_bound_flops = 14;  // per axis two differences and two maxima; squares, sums
constexpr float radii[moment_radii] = {0.25f, 0.5f, 1.0f};

double as_double(Index value) { return static_cast<double>(value); }

float squared_distance(const Sphere& s, std::size_t i, std::size_t j) {
  const float dx = s.x[i] - s.x[j], dy = s.y[i] - s.y[j], dz = s.z[i] - s.z[j];
  return dx * dx + dy * dy + dz * dz;
}

/// Ordered pairs of points, each with itself included, nearer than the radius.
double pairs_within(const Sphere& s, float radius) {
  double pairs = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    for (std::size_t j = 0; j < s.x.size(); ++j) {
      pairs += squared_distance(s, i, j) < radius * radius ? 1 : 0;
    }
  }
  return pairs;
}

/// Squared distance to the k-th nearest point, the point itself included.
float kth_squared(const Sphere& s, std::size_t i, Index k) {
  std::vector<float> all(s.x.size());
  for (std::size_t j = 0; j < all.size(); ++j) all[j] = squared_distance(s, i, j);
  std::nth_element(all.begin(), all.begin() + (k - 1), all.end());
  return all[static_cast<std::size_t>(k - 1)];
}

/// The work that the bounds of an exact search for the k nearest of every point leave, estimated
/// from every 16th point.
Work search_work(const Sphere& s, const SpatialIndex& index, Index k, double bytes_out) {
  Floats bounds = room(index.leaves() + packet_size);
  double visited = 0, queries = 0;
  for (std::size_t i = 0; i < s.x.size(); i += 16, ++queries) {
    const float limit = kth_squared(s, i, k);
    index.leaf_bounds(s.x[i], s.y[i], s.z[i], bounds.data());
    visited += as_double(std::count_if(bounds.begin(), bounds.begin() + index.leaves(),
                                       [&](float bound) { return bound <= limit; }));
  }
  const double per_query = box_bound_flops * as_double(index.leaves()) +
                           distance_flops * SpatialIndex::leaf_size * visited / queries;
  const double count = as_double(index.count());
  return {count * per_query, count * (12 + bytes_out)};
}

void spatial_index_build(benchmark::State& state) {
  const Sphere points(state.range(0));
  SpatialIndex index(state.range(0));
  for (auto _ : state) {
    index.build(points.coordinates(), state.range(0));
    benchmark::ClobberMemory();
  }
  count(state, {0, as_double(state.range(0)) * (12 + 16)});
}
BENCHMARK(spatial_index_build)->Arg(128)->Arg(1024)->Arg(16384)->Unit(benchmark::kMicrosecond);

/// k = 20, as the paper's network; index included.
void mean_neighbours(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  NeighbourScratch scratch(points_count);
  Floats out[4];
  for (Floats& o : out) o = room(points_count);
  for (auto _ : state) {
    index.build(points.coordinates(), points_count);
    mean_neighbour_offsets(index, 20, 0, index.leaves(), scratch, out[0].data(), out[1].data(),
                           out[2].data(), out[3].data());
    benchmark::ClobberMemory();
  }
  count(state, search_work(points, index, 20, 16));
}
BENCHMARK(mean_neighbours)
    ->Arg(128)
    ->Arg(512)
    ->Arg(1024)
    ->Arg(4096)
    ->Arg(16384)
    ->Unit(benchmark::kMicrosecond);

/// k = 14, as the tangent planes of mode verified.
void nearest_points_lists(benchmark::State& state) {
  constexpr Index k = 14;
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  NeighbourScratch scratch(points_count);
  std::vector<std::uint16_t> neighbours(static_cast<std::size_t>(k * points_count));
  for (auto _ : state) {
    nearest_points(index, k, 0, index.leaves(), scratch, neighbours.data());
    benchmark::ClobberMemory();
  }
  count(state, search_work(points, index, k, 2 * k));
}
BENCHMARK(nearest_points_lists)->Arg(512)->Arg(1024)->Arg(2048)->Unit(benchmark::kMicrosecond);

/// The nearest point of a cloud to every point of the same cloud, moved a little.
void nearest(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  NeighbourScratch scratch(points_count);
  Floats squared = room(points_count);
  Floats moved[3];
  const Coordinates o = index.ordered();
  const float* from[3] = {o.x, o.y, o.z};
  for (Index axis = 0; axis < 3; ++axis) {
    moved[axis].assign(from[axis], from[axis] + points_count);
    for (float& v : moved[axis]) v += 0.01f;
  }
  for (auto _ : state) {
    nearest_distances(index, {moved[0].data(), moved[1].data(), moved[2].data()}, points_count,
                      scratch, squared.data());
    benchmark::ClobberMemory();
  }
  count(state, search_work(points, index, 2, 4));
}
BENCHMARK(nearest)->Arg(512)->Arg(1024)->Arg(4096)->Arg(16384)->Unit(benchmark::kMicrosecond);

/// A grid of nearest points over a cloud, in radii of the sphere.
struct Grid {
  explicit Grid(Index count) : points(count), index(count), scratch(count) {
    index.build(points.coordinates(), count);
    grid.allocate();
    fill();
  }
  void fill() {
    grid.place(index, 0.2f, 0.3f);
    for (Index slab = 0; slab < grid.slabs(); ++slab) grid.fill(index, slab, scratch);
  }

  Sphere points;
  SpatialIndex index;
  NeighbourScratch scratch;
  NearestGrid grid;
};

void nearest_grid_fill(benchmark::State& state) {
  Grid g(state.range(0));
  for (auto _ : state) {
    g.fill();
    benchmark::ClobberMemory();
  }
  // A sphere of the reach about every point: the distances of its cells.
  const double reach = 0.3 / static_cast<double>(g.grid.cell_size());
  const double cells = 4.19 * reach * reach * reach;
  count(state, {as_double(state.range(0)) * cells * distance_flops,
                12 * as_double(state.range(0)) + 2 * as_double(g.grid.size())});
}
BENCHMARK(nearest_grid_fill)->Arg(512)->Arg(1024)->Arg(2048)->Unit(benchmark::kMicrosecond);

/// One look-up for each point of the cloud: the query, the cell, the place found.
void nearest_grid_lookup(benchmark::State& state) {
  const Grid g(state.range(0));
  std::vector<std::uint16_t> found(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    g.grid.nearest(g.points.coordinates(), state.range(0), found.data());
    benchmark::ClobberMemory();
  }
  count(state, {9 * as_double(state.range(0)), (12 + 2 + 2) * as_double(state.range(0))});
}
BENCHMARK(nearest_grid_lookup)->Arg(64)->Arg(1024);

/// Points with normals by their places: a record and a place in, six numbers out.
void gather_oriented_points(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Floats records = random_floats(points_count * oriented_point_size);
  std::vector<std::uint16_t> places(static_cast<std::size_t>(points_count));
  std::iota(places.begin(), places.end(), std::uint16_t{0});
  std::shuffle(places.begin(), places.end(), std::mt19937_64(1));
  Floats out[6];
  for (Floats& o : out) o = room(points_count);
  const OrientedArrays arrays{out[0].data(), out[1].data(), out[2].data(),
                              out[3].data(), out[4].data(), out[5].data()};
  for (auto _ : state) {
    gather_points(records.data(), places.data(), points_count, arrays);
    benchmark::ClobberMemory();
  }
  count(state, {0, as_double(points_count) * (4 * oriented_point_size + 2 + 24)});
}
BENCHMARK(gather_oriented_points)->Arg(64)->Arg(1024);

/// Moments of a cloud about half of its points (the encoded ones), at three radii. Counted: the
/// powers of the offsets of every point within a radius, 40 flops each.
void moments_of_half(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  Floats bounds = room(index.leaves() + packet_size);
  Moments moments[moment_radii];
  for (auto _ : state) {
    for (std::size_t i = 0; i < points.x.size(); i += 2) {
      const float centre[3] = {points.x[i], points.y[i], points.z[i]};
      radius_moments(index, centre, radii, bounds.data(), moments);
      benchmark::DoNotOptimize(moments);
    }
  }
  double pairs = 0;
  for (const float radius : radii) pairs += 0.5 * pairs_within(points, radius);
  count(state, {40 * pairs, as_double(points_count) * (12 + sizeof(moments) / 2.0)});
}
BENCHMARK(moments_of_half)->Arg(512)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);

/// Features of one point from its moments; argument: points.
void moment_features_points(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  Floats bounds = room(index.leaves() + packet_size);
  const float centre[3] = {points.x[0], points.y[0], points.z[0]};
  Moments moments[moment_radii];
  radius_moments(index, centre, radii, bounds.data(), moments);
  MomentFeatures features;
  for (auto _ : state) {
    for (Index i = 0; i < points_count; ++i) {
      moment_features(moments, centre, features);
      benchmark::DoNotOptimize(features);
    }
  }
  count(state, {0, as_double(points_count) * (sizeof(moments) + sizeof(features))});
}
BENCHMARK(moment_features_points)->Arg(512)->Unit(benchmark::kMicrosecond);

/// Sums of messages of 192 numbers over the neighbourhoods of all points, radius 0.5, tile by tile
/// in spatial order.
void collect_neighbourhoods(benchmark::State& state) {
  constexpr Index length = 192;
  constexpr float radius = 0.5f;
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  const Floats rows = random_floats(points_count * length);
  CollectScratch scratch(points_count);
  Floats out = room(tile * length);
  for (auto _ : state) {
    for (Index first = 0; first < points_count; first += tile) {
      collect_rows(index.ordered(), points_count, first, std::min(tile, points_count - first),
                   radius, rows.data(), length, scratch, out.data());
      benchmark::ClobberMemory();
    }
  }
  const double n = as_double(points_count);
  count(state, {2.0 * length * pairs_within(points, radius) + (distance_flops + 4) * n * n,
                4 * n * (2 * length + 3)});
}
BENCHMARK(collect_neighbourhoods)->Arg(256)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);

/// Which of the distances of one point from all others are within a radius.
void mark_within_limit(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Floats values = random_floats(points_count);
  std::vector<std::uint8_t> within(static_cast<std::size_t>(points_count));
  for (auto _ : state) {
    mark_within(values.data(), points_count, -0.1f, within.data());
    benchmark::ClobberMemory();
  }
  count(state, {as_double(points_count), 5 * as_double(points_count)});
}
BENCHMARK(mark_within_limit)->Arg(256)->Arg(1024);

/// Weight, offset and covariance of what lies about every 16th point, at two radii. Counted: 30
/// flops for every point within a radius.
void surroundings_of_points(benchmark::State& state) {
  constexpr float two_radii[surroundings_radii] = {0.25f, 0.5f};
  const Index points_count = state.range(0);
  const Sphere points(points_count);
  SpatialIndex index(points_count);
  index.build(points.coordinates(), points_count);
  Floats bounds = room(index.leaves() + packet_size);
  Surroundings out[surroundings_radii];
  for (auto _ : state) {
    for (std::size_t i = 0; i < points.x.size(); i += 16) {
      const float centre[3] = {points.x[i], points.y[i], points.z[i]};
      surroundings(index, centre, two_radii, bounds.data(), out);
      benchmark::DoNotOptimize(out);
    }
  }
  double pairs = 0;
  for (const float radius : two_radii) pairs += pairs_within(points, radius) / 16;
  count(state, {30 * pairs, as_double(points_count) * (12 + sizeof(out) / 16.0)});
}
BENCHMARK(surroundings_of_points)->Arg(1024)->Arg(2048)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vnreg::bench
