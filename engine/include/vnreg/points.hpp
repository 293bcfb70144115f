/// @file
/// How clouds come in: borrowed, as they lie in memory.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "vnreg/error.hpp"

namespace vnreg {

namespace detail {

template <class T>
inline constexpr bool is_float_or_double =
    std::is_same_v<std::remove_cvref_t<T>, float> || std::is_same_v<std::remove_cvref_t<T>, double>;

template <class T>
concept Coordinate = is_float_or_double<T>;

/// std::array<float, 3>, Eigen::Vector3d, double[4], ...: its coordinates are [0], [1] and [2].
template <class Point>
concept IndexedPoint = requires(const Point& p) {
  { p[0] } -> Coordinate;
  requires std::is_lvalue_reference_v<decltype(p[0])>;
  requires sizeof(Point) >= 3 * sizeof(p[0]);
  // Not a handle to coordinates that lie elsewhere.
  requires std::is_trivially_destructible_v<Point> && !std::ranges::borrowed_range<Point>;
};

/// pcl::PointXYZ, geometry_msgs::Point, ...: its coordinates are x, y and z.
template <class Point>
concept NamedPoint = !IndexedPoint<Point> && requires(const Point& p) {
  requires Coordinate<decltype(p.x)>;
  requires std::same_as<decltype(p.x), decltype(p.y)> && std::same_as<decltype(p.x), decltype(p.z)>;
};

template <class Points>
concept PointRange = std::ranges::contiguous_range<const Points> &&
    std::ranges::sized_range<const Points> &&
    (IndexedPoint<std::ranges::range_value_t<const Points>> ||
     NamedPoint<std::ranges::range_value_t<const Points>>);

}  // namespace detail

/// A borrowed cloud: `count` points, each three floats or doubles. Points are `stride_bytes` apart,
/// the coordinates of a point `axis_stride_bytes`. Neither needs to be aligned. Nothing is copied
/// and nothing is kept after the call that takes the view.
///
/// @code
/// std::vector<std::array<float, 3>> a;   // PointsView(a)
/// std::vector<Eigen::Vector3d> b;        // PointsView(b); Open3D: cloud.points_
/// pcl::PointCloud<pcl::PointXYZ> c;      // PointsView(c)
/// Eigen::Matrix3Xd d;                    // PointsView(d.data(), d.cols())
/// Eigen::MatrixX3d e;                    // PointsView(e.data(), e.rows(), sizeof(double),
///                                        //            e.rows() * sizeof(double))
/// sensor_msgs::PointCloud2 f;            // x y z float32 in a row from offset o:
///                                        // PointsView(reinterpret_cast<const float*>(
///                                        //              f.data.data() + o),
///                                        //            f.width * f.height, f.point_step)
/// @endcode
class PointsView {
 public:
  /// The type of the coordinates.
  enum class Scalar {
    float32,  ///< float
    float64,  ///< double
  };

  /// `count` points from `xyz` on; by default packed, x y z x y z.
  PointsView(const float* xyz, std::size_t count, std::size_t stride_bytes = 3 * sizeof(float),
             std::size_t axis_stride_bytes = sizeof(float)) noexcept
      : PointsView(xyz, count, stride_bytes, axis_stride_bytes, Scalar::float32) {}
  /// The same of doubles.
  PointsView(const double* xyz, std::size_t count, std::size_t stride_bytes = 3 * sizeof(double),
             std::size_t axis_stride_bytes = sizeof(double)) noexcept
      : PointsView(xyz, count, stride_bytes, axis_stride_bytes, Scalar::float64) {}

  /// Any contiguous range of points: see above. Throws Error (invalid_points) for points whose x, y
  /// and z do not lie at equal distances.
  template <detail::PointRange Points>
  PointsView(const Points& points)  // NOLINT: implicit on purpose
      : PointsView(of_range(std::ranges::data(points), std::ranges::size(points))) {}

  /// The first point's x; floats or doubles, as scalar() says.
  const void* data() const noexcept { return data_; }
  /// How many points.
  std::size_t size() const noexcept { return count_; }
  /// Bytes from a point to the next.
  std::size_t stride_bytes() const noexcept { return stride_bytes_; }
  /// Bytes from x to y, and from y to z.
  std::size_t axis_stride_bytes() const noexcept { return axis_stride_bytes_; }
  /// What the coordinates are.
  Scalar scalar() const noexcept { return scalar_; }

 private:
  PointsView(const void* data, std::size_t count, std::size_t stride_bytes,
             std::size_t axis_stride_bytes, Scalar scalar) noexcept
      : data_(data),
        count_(count),
        stride_bytes_(stride_bytes),
        axis_stride_bytes_(axis_stride_bytes),
        scalar_(scalar) {}

  template <detail::IndexedPoint Point>
  static PointsView of_range(const Point* points, std::size_t count) {
    if (count == 0) return {static_cast<const float*>(nullptr), 0};
    return {&(*points)[0], count, sizeof(Point)};
  }
  template <detail::NamedPoint Point>
  static PointsView of_range(const Point* points, std::size_t count) {
    if (count == 0) return {static_cast<const float*>(nullptr), 0};
    const auto* x = reinterpret_cast<const char*>(&points->x);
    const auto y = reinterpret_cast<const char*>(&points->y) - x;
    const auto z = reinterpret_cast<const char*>(&points->z) - x;
    if (y <= 0 || z != 2 * y) {
      throw Error(ErrorCode::invalid_points, "points", "x, y and z at equal distances",
                  "y at byte " + std::to_string(y) + ", z at byte " + std::to_string(z));
    }
    return {&points->x, count, sizeof(Point), static_cast<std::size_t>(y)};
  }

  const void* data_;
  std::size_t count_;
  std::size_t stride_bytes_;
  std::size_t axis_stride_bytes_;
  Scalar scalar_;
};

}  // namespace vnreg
