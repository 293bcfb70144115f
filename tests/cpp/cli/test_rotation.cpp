#include "../../../cli/rotation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

using namespace vnreg;
using namespace vnreg::cli;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// Rodrigues' formula.
Pose rotation_about(const std::array<double, 3>& u, double angle_deg) {
  const double c = std::cos(angle_deg * degree);
  const double s = std::sin(angle_deg * degree);
  Pose pose = identity_pose;
  const double cross[3][3] = {{0, -u[2], u[1]}, {u[2], 0, -u[0]}, {-u[1], u[0], 0}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      pose[4 * i + j] = (i == j ? c : 0) + (1 - c) * u[i] * u[j] + s * cross[i][j];
    }
  }
  return pose;
}

std::array<double, 3> random_axis(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::array<double, 3> axis{normal(random), normal(random), normal(random)};
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  for (double& value : axis) value /= length;
  return axis;
}

}  // namespace

TEST_CASE("axis and angle come back at every angle", "[rotation]") {
  std::mt19937 random(1);
  const double angle = GENERATE(1e-6, 1e-3, 1.0, 45.0, 89.999, 90.0, 120.0, 179.0, 179.999999);
  for (int i = 0; i < 100; ++i) {
    const std::array<double, 3> axis = random_axis(random);
    const AxisAngle found = axis_angle(rotation_about(axis, angle));
    CHECK(found.angle_deg == Approx(angle).epsilon(1e-9).margin(1e-12));
    for (std::size_t k = 0; k < 3; ++k) CHECK(found.axis[k] == Approx(axis[k]).margin(1e-7));
  }
}

TEST_CASE("half a turn and no turn", "[rotation]") {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const std::array<double, 3> axis = random_axis(random);
    const AxisAngle found = axis_angle(rotation_about(axis, 180));
    CHECK(found.angle_deg == Approx(180));
    const double dot = found.axis[0] * axis[0] + found.axis[1] * axis[1] + found.axis[2] * axis[2];
    CHECK(std::abs(dot) == Approx(1));
  }
  CHECK(axis_angle(identity_pose).angle_deg == 0);
  CHECK(axis_angle(identity_pose).axis == std::array<double, 3>{0, 0, 1});
}

TEST_CASE("the difference of two rotations is the angle between them", "[rotation]") {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const std::array<double, 3> axis = random_axis(random);
    const Pose a = rotation_about(axis, 30);
    const Pose b = rotation_about(axis, 30 + i * 1.7);
    CHECK(rotation_difference_deg(a, b) == Approx(i * 1.7).margin(1e-6));
  }
  Pose broken = identity_pose;
  broken[5] = std::nan("");
  CHECK(std::isnan(rotation_difference_deg(broken, identity_pose)));
}

TEST_CASE("a pose moves a point by R p + t", "[rotation]") {
  Pose pose = rotation_about({0, 0, 1}, 90);
  pose[3] = 10;
  pose[7] = 20;
  pose[11] = 30;
  const std::array<double, 3> moved = transform(pose, {1, 2, 3});
  CHECK(moved[0] == Approx(8));
  CHECK(moved[1] == Approx(21));
  CHECK(moved[2] == Approx(33));
  CHECK(translation_difference(pose, identity_pose) == Approx(std::sqrt(1400.0)));
}
