#include "engine/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/rigid.hpp"

namespace vnreg::detail {
namespace {

using kernels::RigidTransform;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// The weight of distances in all directions beside that along the normal: it holds the directions
// in which surfaces slide on each other, as planes and turned bodies do.
constexpr double point_weight = 0.05;
// Relative to the mean diagonal: what keeps the system solvable when nothing matches.
constexpr double damping = 1e-9;
// In radians and in radii.
constexpr double smallest_step = 1e-4;

/// The sums of a Gauss-Newton step in the unknowns (rotation vector, translation).
class NormalEquations {
 public:
  void add(const Matches& m, float tolerance) noexcept {
    alignas(64) float jacobian[6][Matches::capacity], weighted[6][Matches::capacity];
    alignas(64) float residual[Matches::capacity], weight[Matches::capacity];
    const float scale = tolerance * tolerance;
#pragma omp simd
    for (Index i = 0; i < m.count; ++i) {
      const float nx = m.normal_x[i], ny = m.normal_y[i], nz = m.normal_z[i];
      const float share = scale / (scale + m.squared[i]);
      weight[i] = share * share * m.agreement[i];
      residual[i] = (m.x[i] - m.nearest_x[i]) * nx + (m.y[i] - m.nearest_y[i]) * ny +
                    (m.z[i] - m.nearest_z[i]) * nz;
      jacobian[0][i] = m.y[i] * nz - m.z[i] * ny;
      jacobian[1][i] = m.z[i] * nx - m.x[i] * nz;
      jacobian[2][i] = m.x[i] * ny - m.y[i] * nx;
      jacobian[3][i] = nx;
      jacobian[4][i] = ny;
      jacobian[5][i] = nz;
      for (int k = 0; k < 6; ++k) weighted[k][i] = weight[i] * jacobian[k][i];
    }
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b <= a; ++b) matrix_(a, b) += dot(weighted[a], jacobian[b], m.count);
      right_(a) -= dot(weighted[a], residual, m.count);
    }
    add_points(m, weight);
  }

  Vector6 solution() const noexcept {
    Matrix6 full = matrix_;
    Vector6 right = right_;
    // Point to point: residual e = x - y, Jacobian (-[x]_x | I).
    const Eigen::Matrix3d turn = squares_.trace() * Eigen::Matrix3d::Identity() - squares_;
    Eigen::Matrix3d cross;
    cross << 0, -sum_.z(), sum_.y(), sum_.z(), 0, -sum_.x(), -sum_.y(), sum_.x(), 0;
    full.topLeftCorner<3, 3>() += point_weight * turn;
    full.bottomLeftCorner<3, 3>() -= point_weight * cross;
    full.bottomRightCorner<3, 3>() += point_weight * weights_ * Eigen::Matrix3d::Identity();
    right.head<3>() -= point_weight * torque_;
    right.tail<3>() -= point_weight * offset_;
    full.diagonal().array() += damping * full.trace() / 6 + 1e-30;
    return full.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  }

 private:
  using Numbers = Eigen::Map<const Eigen::ArrayXf, Eigen::Aligned64>;

  static double dot(const float* a, const float* b, Index count) noexcept {
    return static_cast<double>((Numbers(a, count) * Numbers(b, count)).sum());
  }

  static double total(const float* a, Index count) noexcept {
    return static_cast<double>(Numbers(a, count).sum());
  }

  void add_points(const Matches& m, const float* weight) noexcept {
    const float* position[3] = {m.x, m.y, m.z};
    const float* nearest[3] = {m.nearest_x, m.nearest_y, m.nearest_z};
    alignas(64) float weighted[3][Matches::capacity], offset[3][Matches::capacity];
    for (int axis = 0; axis < 3; ++axis) {
#pragma omp simd
      for (Index i = 0; i < m.count; ++i) {
        weighted[axis][i] = weight[i] * position[axis][i];
        offset[axis][i] = position[axis][i] - nearest[axis][i];
      }
    }
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      for (int d = 0; d < 3; ++d) squares_(a, d) += dot(weighted[a], position[d], m.count);
      torque_(a) += dot(weighted[b], offset[c], m.count) - dot(weighted[c], offset[b], m.count);
      offset_(a) += dot(weight, offset[a], m.count);
      sum_(a) += total(weighted[a], m.count);
    }
    weights_ += total(weight, m.count);
  }

  Matrix6 matrix_ = Matrix6::Zero();  // lower triangle
  Vector6 right_ = Vector6::Zero();
  double weights_ = 0;                                 // sum w
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();      // sum w x
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();  // sum w x x^T
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();   // sum w e
  Eigen::Vector3d torque_ = Eigen::Vector3d::Zero();   // sum w x cross e
};

RigidTransform motion_of(const Vector6& step) noexcept {
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  RigidTransform motion;
  if (angle > 0) motion.rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  motion.translation = step.tail<3>();
  return motion;
}

}  // namespace

RigidTransform refine(const RigidTransform& start, const Surface surface[2],
                      const RefineStage& stage) noexcept {
  const Index total = std::min(stage.points, surface[0].count);
  RigidTransform pose = start;
  Matches matches;
  for (int k = 0; k < stage.most_steps; ++k) {
    const Motion motion = to_motion(pose);
    NormalEquations equations;
    for (Index first = 0; first < total; first += Matches::capacity) {
      match_points(motion, surface[0], first, std::min(Matches::capacity, total - first),
                   surface[1], stage.search, matches);
      equations.add(matches, stage.tolerance);
    }
    const Vector6 step = equations.solution();
    if (!step.allFinite()) break;
    pose = kernels::compose(motion_of(step), pose);
    if (step.cwiseAbs().maxCoeff() < smallest_step) break;
  }
  return orthonormal(pose);
}

}  // namespace vnreg::detail
