#include "engine/surface.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/workspace.hpp"
#include "kernels/least_direction.hpp"

namespace vnreg::detail {
namespace {

using kernels::Coordinates;
using kernels::SpatialIndex;

constexpr Index leaves_per_task = 8;
// Spacing below which duplicates, not the surface, would set the tolerances.
constexpr float smallest_spacing = 0.01f;
// Variance across the main direction, relative to that along it, of what float32 leaves of a line.
constexpr double line_threshold = 1e-8;
// Below it, its reciprocal leaves the range of float32.
constexpr double smallest_radius = 1e-30;
// R.m.s. of a normal distribution, per median of its absolute values.
constexpr float normal_from_median = 1.4826f;
// The grid covers what lies where the widest comparison ends, and is exact a little farther, in the
// corners and hollows that it covers, too.
constexpr float margin_in_spacings = 6.0f;
constexpr float reach_in_spacings = 9.0f;

/// Of the numbers 0 .. 2^bits - 1, that whose bits are those of v in reverse order.
std::uint32_t reversed(std::uint32_t v, int bits) noexcept {
  std::uint32_t r = 0;
  for (int b = 0; b < bits; ++b) r |= ((v >> b) & 1u) << (bits - 1 - b);
  return r;
}

/// The place of point i into its record.
void write_place(Surface& s, Index i) noexcept {
  float* record = s.records.data() + kernels::oriented_point_size * i;
  record[0] = s.x[static_cast<std::size_t>(i)];
  record[1] = s.y[static_cast<std::size_t>(i)];
  record[2] = s.z[static_cast<std::size_t>(i)];
}

/// Takes evenly from the spatial order, in bit-reversed order: every prefix is spread evenly. The
/// index keeps the spatial order.
void take_points(const Cloud& cloud, float per_radius, Surface& s) noexcept {
  const Coordinates ordered = cloud.index.ordered();
  s.count = std::min(cloud.count, static_cast<Index>(s.x.size()));
  const auto bits = static_cast<int>(std::bit_width(static_cast<std::uint32_t>(s.count - 1)));
  Index taken = 0;
  for (std::uint32_t v = 0; taken < s.count; ++v) {
    const auto place = static_cast<Index>(reversed(v, bits));
    if (place >= s.count) continue;
    const Index from = place * cloud.count / s.count;
    const auto at = static_cast<std::size_t>(taken), in_order = static_cast<std::size_t>(place);
    s.origin[at] = cloud.index.original()[from];
    s.flat_x[in_order] = s.x[at] = ordered.x[from] * per_radius;
    s.flat_y[in_order] = s.y[at] = ordered.y[from] * per_radius;
    s.flat_z[in_order] = s.z[at] = ordered.z[from] * per_radius;
    s.order[in_order] = static_cast<std::uint32_t>(taken);
    write_place(s, taken);
    ++taken;
  }
  s.index.build_ordered({s.flat_x.data(), s.flat_y.data(), s.flat_z.data()}, s.order.data(),
                        s.count);
}

Eigen::Vector3d point_at(const Surface& s, std::size_t i) noexcept {
  return Eigen::Vector3f(s.x[i], s.y[i], s.z[i]).cast<double>();
}

/// Lower median. Reorders the values.
float median(float* values, Index count) noexcept {
  float* middle = values + (count - 1) / 2;
  std::nth_element(values, middle, values + count);
  return *middle;
}

/// The neighbourhoods of up to as many points as a task fits: what their planes are found from.
struct Neighbourhoods {
  static constexpr Index capacity = leaves_per_task * SpatialIndex::leaf_size;
  /// Sums over the offsets of a point's neighbours.
  alignas(64) float x[capacity], y[capacity], z[capacity];
  /// Their covariances, times the number of neighbours.
  alignas(64) float xx[capacity], xy[capacity], xz[capacity];
  alignas(64) float yy[capacity], yz[capacity], zz[capacity];
  alignas(64) float farthest[capacity];  // squared distance
};

/// The neighbours of a point, as offsets from it; zeros follow the last.
struct Offsets {
  alignas(64) float x[neighbour_lanes], y[neighbour_lanes], z[neighbour_lanes];

  Offsets(const Surface& s, Index own) noexcept {
    std::uint16_t places[neighbour_lanes];
    std::copy_n(s.neighbours.data() + surface_neighbours * own, surface_neighbours, places);
    std::fill(places + surface_neighbours, places + neighbour_lanes,
              static_cast<std::uint16_t>(own));
    float normals[3][neighbour_lanes];  // which are not there yet
    kernels::gather_points(s.records.data(), places, neighbour_lanes,
                           {x, y, z, normals[0], normals[1], normals[2]});
    const float* centre = s.records.data() + kernels::oriented_point_size * own;
#pragma omp simd
    for (Index n = 0; n < neighbour_lanes; ++n) {
      x[n] -= centre[0];
      y[n] -= centre[1];
      z[n] -= centre[2];
    }
  }
};

/// Neighbourhood `i` is that of point `own`.
void measure_neighbourhood(const Surface& s, Index own, Index i, Neighbourhoods& out) noexcept {
  using Lanes = Eigen::Map<const Eigen::Array<float, neighbour_lanes, 1>, Eigen::Aligned64>;
  const Offsets offsets(s, own);
  const Lanes x(offsets.x), y(offsets.y), z(offsets.z);
  constexpr float share = 1.0f / static_cast<float>(surface_neighbours);
  const float sx = x.sum(), sy = y.sum(), sz = z.sum();
  out.x[i] = sx;
  out.y[i] = sy;
  out.z[i] = sz;
  out.xx[i] = x.square().sum() - share * sx * sx;
  out.xy[i] = (x * y).sum() - share * sx * sy;
  out.xz[i] = (x * z).sum() - share * sx * sz;
  out.yy[i] = y.square().sum() - share * sy * sy;
  out.yz[i] = (y * z).sum() - share * sy * sz;
  out.zz[i] = z.square().sum() - share * sz * sz;
  out.farthest[i] = (x.square() + y.square() + z.square()).maxCoeff();
}

/// The direction in which the point's neighbours vary least, and the point's place in the plane
/// across it through their centroid.
void write_plane(const Neighbourhoods& n, Index i, const Eigen::Vector3f& normal, std::size_t own,
                 Surface& s) noexcept {
  s.normal_x[own] = normal.x();
  s.normal_y[own] = normal.y();
  s.normal_z[own] = normal.z();
  s.spread_squared[own] = n.farthest[i];
  const Eigen::Vector3f centroid =
      Eigen::Vector3f(n.x[i], n.y[i], n.z[i]) / static_cast<float>(surface_neighbours);
  const float height = -normal.dot(centroid);
  s.height[own] = std::abs(height);
  s.flat_x[own] = s.x[own] - height * normal.x();
  s.flat_y[own] = s.y[own] - height * normal.y();
  s.flat_z[own] = s.z[own] - height * normal.z();
}

void fit_planes(Surface& s, Index first_leaf, Index last_leaf,
                kernels::NeighbourScratch& scratch) noexcept {
  kernels::nearest_points(s.index, surface_neighbours, first_leaf, last_leaf, scratch,
                          s.neighbours.data());
  const Index first = first_leaf * SpatialIndex::leaf_size;
  const Index count = std::min(last_leaf * SpatialIndex::leaf_size, s.count) - first;
  const std::uint32_t* points = s.index.original() + first;
  Neighbourhoods n;
  for (Index i = 0; i < count; ++i) measure_neighbourhood(s, Index{points[i]}, i, n);
  alignas(64) float x[Neighbourhoods::capacity], y[Neighbourhoods::capacity],
      z[Neighbourhoods::capacity];
  kernels::least_directions({n.xx, n.xy, n.xz, n.yy, n.yz, n.zz}, count, x, y, z);
  for (Index i = 0; i < count; ++i) write_plane(n, i, {x[i], y[i], z[i]}, points[i], s);
}

/// What matches are looked up in: the records of the points and the places of their neighbours.
void write_lookups(Surface& s) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count); ++i) {
    write_place(s, static_cast<Index>(i));
    float* record = s.records.data() + kernels::oriented_point_size * static_cast<Index>(i);
    record[3] = s.normal_x[i];
    record[4] = s.normal_y[i];
    record[5] = s.normal_z[i];
    const std::uint16_t* neighbours =
        s.neighbours.data() + surface_neighbours * static_cast<Index>(i);
    float* places = s.neighbour_places.data() + 3 * neighbour_lanes * static_cast<Index>(i);
    for (Index n = 0; n < neighbour_lanes; ++n) {
      // The lanes behind the last neighbour repeat the first.
      const std::size_t at = neighbours[n < surface_neighbours ? n : 0];
      places[n] = s.x[at];
      places[n + neighbour_lanes] = s.y[at];
      places[n + 2 * neighbour_lanes] = s.z[at];
    }
  }
}

/// Moves the points into their planes.
void flatten(Surface& s) noexcept {
  s.noise = normal_from_median * median(s.height.data(), s.count);
  std::swap(s.x, s.flat_x);
  std::swap(s.y, s.flat_y);
  std::swap(s.z, s.flat_z);
  write_lookups(s);
  measure_extents(s.coordinates(), std::min(s.count, most_extent_points), s.extents);
}

bool is_line(const Surface& s) noexcept {
  const auto count = static_cast<double>(s.count);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  // About a point of the surface: where all coincide, exact zeros are left, not rounding.
  const Eigen::Vector3d first = point_at(s, 0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count); ++i) {
    const Eigen::Vector3d p = point_at(s, i) - first;
    sum += p;
    squares += p * p.transpose();
  }
  const Eigen::Matrix3d covariance = squares - sum * sum.transpose() / count;
  const Eigen::Vector3d variances =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly)
          .eigenvalues();
  return !(variances(1) > line_threshold * variances(2));
}

}  // namespace

Surface::Surface(Index max_points) : index(std::min(max_points, most_surface_points)) {
  const auto points = static_cast<std::size_t>(std::min(max_points, most_surface_points));
  for (kernels::Floats* array : {&x, &y, &z, &normal_x, &normal_y, &normal_z, &spread_squared,
                                 &flat_x, &flat_y, &flat_z, &height}) {
    array->resize(points);
  }
  records.resize(points * static_cast<std::size_t>(kernels::oriented_point_size));
  origin.resize(points);
  order.resize(points);
  neighbours.resize(points * static_cast<std::size_t>(surface_neighbours));
  neighbour_places.resize(points * static_cast<std::size_t>(3 * neighbour_lanes));
  grid.allocate();
}

void fit_surfaces(Workspace& w) noexcept {
  Surface* surface = w.verified.surface;
  const auto per_radius = static_cast<float>(1 / w.verified.radius);
  const auto whole = [](Index) { return 1; };
  parallel_for_parts(w.threads, w.sides, whole, [&](Index side, Index, int) {
    take_points(w.cloud[side], per_radius, surface[side]);
  });
  const auto tasks = [&](Index side) {
    return (surface[side].index.leaves() + leaves_per_task - 1) / leaves_per_task;
  };
  parallel_for_parts(w.threads, w.sides, tasks, [&](Index side, Index task, int thread) {
    Surface& s = surface[side];
    const Index first = task * leaves_per_task;
    fit_planes(s, first, std::min(first + leaves_per_task, s.index.leaves()),
               w.scratch[static_cast<std::size_t>(thread)].neighbours);
  });
  parallel_for_parts(w.threads, w.sides, whole, [&](Index side, Index, int) {
    Surface& s = surface[side];
    s.spacing = std::sqrt(median(s.spread_squared.data(), s.count) /
                          static_cast<float>(surface_neighbours));
    s.line = is_line(s);
    flatten(s);
  });
}

bool build_surfaces(Workspace& w) noexcept {
  Surface* surface = w.verified.surface;
  if (!(w.verified.radius > smallest_radius)) return false;
  fit_surfaces(w);
  if (surface[0].line || surface[1].line) return false;
  const float spacing = std::max({smallest_spacing, surface[0].spacing, surface[1].spacing});
  w.verified.spacing = spacing;
  // How far the grids are exact depends on both clouds: no part of a prepared one.
  for (Surface& s : w.verified.surface) {
    s.grid.place(s.index, margin_in_spacings * spacing, reach_in_spacings * spacing);
  }
  parallel_for_parts(
      w.threads, both_sides, [&](Index side) { return surface[side].grid.slabs(); },
      [&](Index side, Index slab, int thread) {
        surface[side].grid.fill(surface[side].index, slab,
                                w.scratch[static_cast<std::size_t>(thread)].neighbours);
      });
  return true;
}

}  // namespace vnreg::detail
