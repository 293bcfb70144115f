#include "engine/cloud.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "engine/counter_hash.hpp"

namespace vnreg::detail {
namespace {

// Beyond it, sums and differences of a few coordinates could overflow float64.
constexpr double largest_coordinate = 1e300;
// Beyond it, sums of a few squares could overflow float32.
constexpr double largest_network_coordinate = 1e15;
// A cloud whose radius is smaller, relative to its coordinates, is one point and rounding.
constexpr double smallest_relative_radius = 1e-12;
// A cloud thinner than this, relative to its length, is a line and rounding: no rotation about the
// line is determined. The network cannot tell, because its VN-ReLUs enlarge the rounding.
constexpr double smallest_relative_thickness = 1e-5;

struct Point {
  double x, y, z;
};

template <class Scalar>
Point read_point(const PointsView& points, std::size_t i) noexcept {
  const auto* x = static_cast<const std::byte*>(points.data()) + i * points.stride_bytes();
  Scalar xyz[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::memcpy(xyz + axis, x + axis * points.axis_stride_bytes(), sizeof(Scalar));
  }
  return {static_cast<double>(xyz[0]), static_cast<double>(xyz[1]), static_cast<double>(xyz[2])};
}

inline bool usable(const Point& p) noexcept {  // false for NaN, too
  return std::abs(p.x) <= largest_coordinate && std::abs(p.y) <= largest_coordinate &&
         std::abs(p.z) <= largest_coordinate;
}

// Points between two looks at the clock: a fraction of a millisecond.
constexpr std::size_t points_per_look = 2048;

bool time_is_up(std::size_t i, Deadline& deadline) noexcept {
  return i % points_per_look == 0 && deadline.passed();
}

/// Sorts by index, in pieces of a fraction of a millisecond; stops short when the deadline passes.
void sort_by_index(Cloud::Candidate* first, Cloud::Candidate* last, Deadline& deadline) noexcept {
  constexpr std::ptrdiff_t sorted_at_once = 2048;
  const auto earlier = [](const auto& a, const auto& b) { return a.index < b.index; };
  if (deadline.passed()) return;
  if (last - first <= sorted_at_once) return std::sort(first, last, earlier);
  Cloud::Candidate* middle = first + (last - first) / 2;
  std::nth_element(first, middle, last, earlier);
  sort_by_index(first, middle, deadline);
  sort_by_index(middle, last, deadline);
}

/// Keeps the candidates with the smallest hashes of those that are offered, by a heap of fixed
/// size. `rank` counts them from 0.
void offer(std::size_t rank, const Cloud::Candidate& candidate,
           std::span<Cloud::Candidate> chosen) noexcept {
  if (rank < chosen.size()) {
    chosen[rank] = candidate;
    if (rank + 1 == chosen.size()) std::make_heap(chosen.begin(), chosen.end());
    return;
  }
  if (!(candidate < chosen.front())) return;
  std::pop_heap(chosen.begin(), chosen.end());
  chosen.back() = candidate;
  std::push_heap(chosen.begin(), chosen.end());
}

/// Chooses max_points of the usable points, in the order of the input. A point's hash is that of
/// its rank among the usable ones, so what was dropped changes nothing.
template <class Scalar>
void choose(const PointsView& points, std::uint64_t seed, Deadline& deadline,
            Cloud& cloud) noexcept {
  std::size_t rank = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (time_is_up(i, deadline)) return;
    if (cloud.dropped > 0 && !usable(read_point<Scalar>(points, i))) continue;
    offer(rank, {counter_hash(seed, rank), i}, cloud.candidates);
    ++rank;
  }
  Cloud::Candidate* first = cloud.candidates.data();
  sort_by_index(first, first + cloud.candidates.size(), deadline);
}

/// How many points are usable; stops at the first that is not, unless those are dropped. The
/// answer means nothing if the deadline passes meanwhile.
template <class Scalar>
std::size_t count_usable(const PointsView& points, bool drop, Deadline& deadline) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (time_is_up(i, deadline)) return count;
    if (usable(read_point<Scalar>(points, i))) {
      ++count;
    } else if (!drop) {
      return count;
    }
  }
  return count;
}

void store(const Point& p, Index place, Cloud& cloud) noexcept {
  double* xyz = cloud.xyz.data() + 3 * place;
  xyz[0] = p.x;
  xyz[1] = p.y;
  xyz[2] = p.z;
}

/// All usable points, which fit.
template <class Scalar>
void take_all(const PointsView& points, Cloud& cloud) noexcept {
  Index place = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point p = read_point<Scalar>(points, i);
    if (cloud.dropped == 0 || usable(p)) store(p, place++, cloud);
  }
}

template <class Scalar>
Status take_points(const PointsView& points, const Gathering& how, Deadline& deadline,
                   Cloud& cloud) noexcept {
  const std::size_t count = count_usable<Scalar>(points, how.drop_non_finite, deadline);
  if (deadline.expired()) return Status::not_finite;
  if (count < points.size() && !how.drop_non_finite) return Status::not_finite;
  cloud.dropped = points.size() - count;
  if (count <= static_cast<std::size_t>(cloud.max_points)) {
    cloud.count = static_cast<Index>(count);
    take_all<Scalar>(points, cloud);
  } else {
    cloud.count = cloud.max_points;
    choose<Scalar>(points, how.seed, deadline, cloud);
    if (deadline.passed()) return Status::not_finite;
    for (Index i = 0; i < cloud.count; ++i) {
      store(read_point<Scalar>(points, cloud.candidates[static_cast<std::size_t>(i)].index), i,
            cloud);
    }
  }
  return cloud.count < how.min_points ? Status::too_few_points : Status::ok;
}

/// Whether a covariance has a second direction.
bool has_thickness(const Eigen::Matrix3d& covariance) noexcept {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& ascending = solver.eigenvalues();
  return ascending(1) > smallest_relative_thickness * smallest_relative_thickness * ascending(2);
}

/// Centroid and r.m.s. radius, both relative to the bounding box, so that no sum overflows and a
/// cloud far from the origin loses nothing. False when the points coincide or lie on a line.
bool measure(Cloud& cloud) noexcept {
  using Points = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  const Points points(cloud.xyz.data(), 3, cloud.count);
  const Eigen::Vector3d low = points.rowwise().minCoeff();
  const Eigen::Vector3d high = points.rowwise().maxCoeff();
  const Eigen::Vector3d middle = low / 2 + high / 2;
  const double half_side = (high / 2 - low / 2).maxCoeff();
  const double magnitude = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  if (!(half_side > smallest_relative_radius * magnitude)) return false;

  const auto count = static_cast<double>(cloud.count);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (Index i = 0; i < cloud.count; ++i) mean += (points.col(i) - middle) / half_side;
  mean /= count;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Index i = 0; i < cloud.count; ++i) {
    const Eigen::Vector3d offset = (points.col(i) - middle) / half_side - mean;
    covariance += offset * offset.transpose();
  }
  covariance /= count;
  Eigen::Map<Eigen::Vector3d>(cloud.centroid) = middle + half_side * mean;
  cloud.rms_radius = half_side * std::sqrt(covariance.trace());
  return cloud.rms_radius > smallest_relative_radius * magnitude && has_thickness(covariance);
}

}  // namespace

Cloud::Cloud(Index max)
    : max_points(max),
      candidates(static_cast<std::size_t>(max)),
      xyz(static_cast<std::size_t>(3 * max)),
      index(max) {
  for (kernels::Floats* array : {&x, &y, &z, &offset_x, &offset_y, &offset_z, &spacing_squared}) {
    array->resize(static_cast<std::size_t>(max));
  }
}

Status gather(const PointsView& points, const Gathering& how, Deadline& deadline,
              Cloud& cloud) noexcept {
  cloud.count = 0;
  cloud.dropped = 0;
  if (points.data() == nullptr || points.size() < static_cast<std::size_t>(how.min_points)) {
    cloud.count = static_cast<Index>(points.data() == nullptr ? 0 : points.size());
    return Status::too_few_points;
  }
  const Status taken = points.scalar() == PointsView::Scalar::float32
                           ? take_points<float>(points, how, deadline, cloud)
                           : take_points<double>(points, how, deadline, cloud);
  if (taken != Status::ok) return taken;
  if (deadline.passed()) return Status::not_finite;
  return measure(cloud) ? Status::ok : Status::degenerate;
}

bool normalize(double scale, Cloud& cloud) noexcept {
  float* network[3] = {cloud.x.data(), cloud.y.data(), cloud.z.data()};
  double largest = 0;
  for (Index i = 0; i < cloud.count; ++i) {
    for (Index axis = 0; axis < 3; ++axis) {
      const double value = (cloud.xyz[3 * i + axis] - cloud.centroid[axis]) / scale;
      largest = std::max(largest, std::abs(value));
      network[axis][i] = static_cast<float>(value);
    }
  }
  return largest <= largest_network_coordinate;
}

}  // namespace vnreg::detail
