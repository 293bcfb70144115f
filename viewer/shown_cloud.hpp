// The points of a cloud that the viewer shows.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "vnreg/points.hpp"

namespace vnreg::viewer {

/// More are not shown: two clouds of so many make a page of less than 5 MB.
inline constexpr std::size_t most_shown_points = 100'000;

/// An even sample of a cloud, as float32 about a point near its middle, so that what is far from
/// the origin loses nothing.
struct ShownCloud {
  std::size_t given = 0;           ///< points of the cloud
  std::size_t unusable = 0;        ///< left out: not finite, or too far from the rest for float32
  std::array<double, 3> origin{};  ///< median of each coordinate, in the cloud's frame
  std::vector<std::array<float, 3>> points;  ///< less the origin; any first ones are a sample, too
};

/// At most most_shown_points of the points, in an order by chance that is always the same.
ShownCloud choose_shown(const PointsView& points);

/// The point less the origin; not finite where it is too far from it for float32.
std::array<float, 3> relative_to(const std::array<double, 3>& origin,
                                 const std::array<double, 3>& point);

}  // namespace vnreg::viewer
