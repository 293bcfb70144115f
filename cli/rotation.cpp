#include "rotation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vnreg::cli {
namespace {

/// Unit quaternion (w, x, y, z) of the rotation part. Its largest component is taken from the
/// diagonal and divides the others (Shepperd's method), so no angle loses digits.
std::array<double, 4> quaternion(const Pose& pose) {
  const auto r = [&](std::size_t row, std::size_t column) { return pose[4 * row + column]; };
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  // Row k holds 4 q_k q, for q = (w, x, y, z).
  const std::array<std::array<double, 4>, 4> rows{{
      {1 + trace, r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)},
      {r(2, 1) - r(1, 2), 1 + 2 * r(0, 0) - trace, r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)},
      {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), 1 + 2 * r(1, 1) - trace, r(1, 2) + r(2, 1)},
      {r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), 1 + 2 * r(2, 2) - trace},
  }};
  std::size_t largest = 0;
  for (std::size_t k = 1; k < 4; ++k) {
    if (rows[k][k] > rows[largest][largest]) largest = k;
  }
  std::array<double, 4> q = rows[largest];
  double squares = 0;
  for (const double value : q) squares += value * value;
  for (double& value : q) value /= std::sqrt(squares);
  return q;
}

}  // namespace

AxisAngle axis_angle(const Pose& pose) {
  const auto [w, x, y, z] = quaternion(pose);
  const double sine = std::hypot(x, y, z);
  if (sine == 0) return {};
  const double sign = w < 0 ? -1 : 1;
  return {2 * std::atan2(sine, std::abs(w)) * 180 / std::numbers::pi,
          {sign * x / sine, sign * y / sine, sign * z / sine}};
}

double rotation_difference_deg(const Pose& a, const Pose& b) {
  Pose difference = identity_pose;  // its rotation part is a^T b
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += a[4 * k + row] * b[4 * k + column];
      difference[4 * row + column] = sum;
    }
  }
  return axis_angle(difference).angle_deg;
}

double translation_difference(const Pose& a, const Pose& b) {
  return std::hypot(a[3] - b[3], a[7] - b[7], a[11] - b[11]);
}

std::array<double, 3> transform(const Pose& pose, const std::array<double, 3>& point) {
  std::array<double, 3> moved{};
  for (std::size_t row = 0; row < 3; ++row) {
    const double* r = pose.data() + 4 * row;
    moved[row] = r[0] * point[0] + r[1] * point[1] + r[2] * point[2] + r[3];
  }
  return moved;
}

}  // namespace vnreg::cli
