// Where a cloud ends: its extent along fixed directions over the sphere. A cloud that shows a part
// of an object, cut off by a crop or by the edge of a view, leaves the rest of it in a half-space;
// points of the other cloud that lie there contradict nothing.
#pragma once

#include <array>

#include "engine/sphere_directions.hpp"
#include "kernels/packets.hpp"
#include "kernels/spatial_index.hpp"

namespace vnreg::detail {

using kernels::Index;

/// Enough points to see where a surface ends.
inline constexpr Index most_extent_points = 512;

using Extents = std::array<float, static_cast<std::size_t>(half_space_directions)>;

/// Along each direction, the extent beyond which few of the points lie (1 in 80: outliers and noise
/// should not move it). `count`: 1 to most_extent_points.
void measure_extents(const kernels::Coordinates& points, Index count, Extents& extents) noexcept;

/// A half-space that the cloud does not reach into, and how many of some points lie in it.
struct HalfSpace {
  float x = 0, y = 0, z = 0;  // its direction
  float extent = 0;           // of the cloud along it
  Index count = 0;

  /// How far a place lies inside.
  float depth(float px, float py, float pz) const noexcept {
    return px * x + py * y + pz * z - extent;
  }
};

/// Of the half-spaces beyond the extents, that with the most of the given points.
HalfSpace most_beyond(const kernels::Coordinates& points, Index count,
                      const Extents& extents) noexcept;

}  // namespace vnreg::detail
