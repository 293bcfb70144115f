// A cloud as mode `verified` sees it: points with normals, and fast answers to "what is nearest?".
#pragma once

#include <cstdint>
#include <vector>

#include "engine/cloud.hpp"
#include "engine/half_spaces.hpp"
#include "kernels/nearest_grid.hpp"
#include "kernels/neighbours.hpp"
#include "kernels/oriented_points.hpp"

namespace vnreg::detail {

struct Workspace;

/// More points make a pose more exact, but not more certain: of larger clouds, this many are used.
inline constexpr Index most_surface_points = 2048;
/// Neighbours, the point itself included, that span a point's tangent plane. Fewer follow the
/// noise, more round off the edges.
inline constexpr Index surface_neighbours = 14;
/// Room for their coordinates: whole packets.
inline constexpr Index neighbour_lanes = 16;

/// Lengths are in units of the larger r.m.s. radius of the pair. The points are in progressive
/// order: the first n of them are spread over the cloud, for any n. They lie where the points given
/// meet their tangent planes: that takes most of the noise out of them, and what it takes off edges
/// it takes off in both clouds.
struct Surface {
  Index count = 0;
  std::vector<std::uint32_t> origin;  // which points of the cloud they are
  kernels::Floats x, y, z;
  kernels::Floats normal_x, normal_y, normal_z;  // unit length, of either sign
  kernels::Floats records;                       // the same, a record each (oriented_points.hpp)
  std::vector<std::uint16_t> neighbours;         // surface_neighbours per point
  kernels::Floats neighbour_places;              // x | y | z of them, each neighbour_lanes long
  kernels::Floats spread_squared;                // squared distance to the farthest of them
  /// Distance between neighbouring points: that to the k-th neighbour over sqrt(k), median. Unlike
  /// the distance to the nearest, it is not 0 when a cloud holds every point twice.
  float spacing = 0;
  /// R.m.s. distance of the points given from their planes, by the median: noise, and curvature.
  float noise = 0;
  bool line = false;  // or a point: it determines no rotation
  Extents extents{};
  kernels::SpatialIndex index;  // of the points given
  kernels::NearestGrid grid;

  std::vector<std::uint32_t> order;        // the points in spatial order, while the index is built
  kernels::Floats flat_x, flat_y, flat_z;  // places in that order, then points in their planes
  kernels::Floats height;                  // of the points given over their planes

  Surface() = default;
  explicit Surface(Index max_points);

  kernels::Coordinates coordinates() const noexcept { return {x.data(), y.data(), z.data()}; }
};

/// Points, planes and spacing of the surfaces of the clouds to compute, in units of
/// workspace.verified.radius.
void fit_surfaces(Workspace& workspace) noexcept;

/// Fills workspace.verified.surface and .spacing from the clouds to compute (the surface of a
/// prepared cloud must be there), in units of workspace.verified.radius. False if a cloud is a line
/// or a point.
bool build_surfaces(Workspace& workspace) noexcept;

}  // namespace vnreg::detail
