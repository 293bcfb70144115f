// Random clouds and poses, and comparisons of poses.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <numbers>
#include <random>
#include <vector>

#include "vnreg/vnreg.hpp"

namespace vnreg::test {

using Points = std::vector<std::array<double, 3>>;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double normal() { return normal_(engine_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// Points on the surface of a lopsided body without symmetry, longest side about 1.
inline Points shape(std::size_t count, Random& random) {
  Points points(count);
  for (auto& p : points) {
    Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
    v.normalize();
    const double bump = 1 + 0.4 * v.x() * v.y() + 0.3 * v.z() * v.z() * v.z() + 0.2 * v.x();
    p = {0.5 * bump * v.x(), 0.35 * bump * v.y(), 0.25 * bump * v.z()};
  }
  return points;
}

/// On the surface of a box about the origin, sides 1, 0.7 and 0.4. Half a turn about any axis maps
/// the points onto themselves.
inline Points box(std::size_t quarter, Random& random) {
  const double half[3] = {0.5, 0.35, 0.2};
  std::discrete_distribution<std::size_t> face({0.28, 0.4, 0.7});  // areas, by normal
  Points points;
  for (std::size_t i = 0; i < quarter; ++i) {
    std::array<double, 3> p;
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = random.uniform(-half[axis], half[axis]);
    const std::size_t normal = face(random.engine());
    p[normal] = p[normal] > 0 ? half[normal] : -half[normal];
    points.push_back(p);
    points.push_back({p[0], -p[1], -p[2]});
    points.push_back({-p[0], p[1], -p[2]});
    points.push_back({-p[0], -p[1], p[2]});
  }
  std::shuffle(points.begin(), points.end(), random.engine());
  return points;
}

/// Uniform over SO(3); translation uniform in a cube of half side `reach`.
inline Eigen::Isometry3d random_motion(Random& random, double reach) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() =
      Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
          .normalized()
          .toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) motion.translation()(axis) = random.uniform(-reach, reach);
  return motion;
}

inline Points moved(const Points& points, const Eigen::Isometry3d& motion, double scale = 1) {
  Points result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(points[i][0], points[i][1], points[i][2]);
    const Eigen::Vector3d q = scale * (motion * p);
    result[i] = {q.x(), q.y(), q.z()};
  }
  return result;
}

inline Eigen::Isometry3d motion_of(const Pose& pose) {
  Eigen::Isometry3d motion;
  motion.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(pose.data());
  return motion;
}

inline double rotation_error_deg(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const double chord = (a.linear() - b.linear()).norm();  // 2 sqrt(2) sin(angle / 2)
  return 2 * std::asin(std::min(1.0, chord / std::sqrt(8.0))) * 180 / std::numbers::pi;
}

inline const Stage& stage(const Registrar& registrar, std::string_view name) {
  for (const Stage& s : registrar.stages()) {
    if (s.name == name) return s;
  }
  throw std::runtime_error("no stage " + std::string(name));
}

}  // namespace vnreg::test
