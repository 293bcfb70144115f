// The rotation of a pose as people read it.
#pragma once

#include <array>

#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct AxisAngle {
  double angle_deg = 0;                 // 0 to 180
  std::array<double, 3> axis{0, 0, 1};  // unit vector; z where the angle is 0
};

/// The axis and angle of the rotation part of `pose`; accurate at every angle, 0 and 180 included.
AxisAngle axis_angle(const Pose& pose);

/// The angle in degrees of the rotation that leads from one pose's rotation to the other's.
double rotation_difference_deg(const Pose& a, const Pose& b);

/// The Euclidean distance of the translations of two poses, in their units.
double translation_difference(const Pose& a, const Pose& b);

/// pose * point.
std::array<double, 3> transform(const Pose& pose, const std::array<double, 3>& point);

}  // namespace vnreg::cli
