#include "viewer/shown_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "engine/counter_hash.hpp"

namespace vnreg::viewer {
namespace {

using Point = std::array<double, 3>;

template <class Scalar>
Point read_as(const PointsView& points, std::size_t i) {
  const auto* x = static_cast<const std::byte*>(points.data()) + i * points.stride_bytes();
  Point point;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Scalar value;
    std::memcpy(&value, x + axis * points.axis_stride_bytes(), sizeof(Scalar));
    point[axis] = static_cast<double>(value);
  }
  return point;
}

Point read_point(const PointsView& points, std::size_t i) {
  return points.scalar() == PointsView::Scalar::float32 ? read_as<float>(points, i)
                                                        : read_as<double>(points, i);
}

template <class Scalar>
bool finite(const std::array<Scalar, 3>& point) {
  return std::ranges::all_of(point, [](Scalar value) { return std::isfinite(value); });
}

/// Indices of the finite points in the order of their hashes.
std::vector<std::size_t> shuffled_finite(const PointsView& points) {
  struct Candidate {
    std::uint64_t hash;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (finite(read_point(points, i))) candidates.push_back({detail::counter_hash(0, i), i});
  }
  std::ranges::sort(candidates, {}, &Candidate::hash);
  std::vector<std::size_t> order;
  order.reserve(candidates.size());
  for (const Candidate& candidate : candidates) order.push_back(candidate.index);
  return order;
}

/// Lower median of each coordinate of the first points of the order.
Point middle_of(const PointsView& points, const std::vector<std::size_t>& order) {
  constexpr std::size_t enough = 10'000;
  const std::size_t count = std::min(order.size(), enough);
  Point middle{};
  if (count == 0) return middle;
  std::vector<double> values(count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < count; ++i) values[i] = read_point(points, order[i])[axis];
    const auto half = values.begin() + static_cast<std::ptrdiff_t>((count - 1) / 2);
    std::nth_element(values.begin(), half, values.end());
    middle[axis] = *half;
  }
  return middle;
}

}  // namespace

std::array<float, 3> relative_to(const Point& origin, const Point& point) {
  std::array<float, 3> relative;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = point[axis] - origin[axis];
    const bool fits = std::abs(value) < static_cast<double>(std::numeric_limits<float>::max());
    relative[axis] = fits ? static_cast<float>(value) : std::numeric_limits<float>::quiet_NaN();
  }
  return relative;
}

ShownCloud choose_shown(const PointsView& points) {
  const std::vector<std::size_t> order = shuffled_finite(points);
  ShownCloud shown;
  shown.given = points.size();
  shown.unusable = points.size() - order.size();
  shown.origin = middle_of(points, order);
  for (const std::size_t i : order) {
    if (shown.points.size() == most_shown_points) break;
    const std::array<float, 3> relative = relative_to(shown.origin, read_point(points, i));
    if (finite(relative)) {
      shown.points.push_back(relative);
    } else {
      ++shown.unusable;
    }
  }
  return shown;
}

}  // namespace vnreg::viewer
