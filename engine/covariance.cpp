#include "engine/covariance.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/rigid.hpp"
#include "engine/verify.hpp"

namespace vnreg::detail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using kernels::RigidTransform;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// A match holds its point along the normal of its plane. How much six numbers are worth, fitted by
// maximum likelihood (Student's t with 4 degrees of freedom) to the errors of 552 right poses of 82
// validation shapes on eight rows of the evaluation: independent samples, noise, crops, outliers,
// uneven and different densities. `inflation`, fitted with the confidence, makes up for the tails.
//
// Variance of a match along its normal, by the mean squared residual and by the squared spacing.
// More than 1, since neighbours share the points that their planes are fitted to.
constexpr double variance_per_squared_residual = 4.2;
constexpr double variance_per_squared_spacing = 0.0013;
// Where noise leaves few near matches, those that are left are less certain, too: information times
// this power of their share.
constexpr double share_power = 0.5;
// Normals tilt with the noise and with the curvature of the surface, and tilted normals seem to
// hold a plane that slides along itself. The squared tilt, by (noise / spacing)^2, and at least:
constexpr double tilt_per_squared_noise = 0.30;
constexpr double least_tilt = 0.012;
// Across the normal, a match tells next to nothing: its nearest point moves with it. Information in
// all directions, per squared spacing.
constexpr double point_information = 0.0009;

Vector3d at(const float* x, const float* y, const float* z, Index i) noexcept {
  return Eigen::Vector3f(x[i], y[i], z[i]).cast<double>();
}

Matrix3d cross_matrix(const Vector3d& v) noexcept {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Sums over matches, each with its weight w, in the target's frame and in radii.
struct Information {
  Matrix6 plane = Matrix6::Zero();  // sum w j j^T, j = (x cross n, n): what the normals hold
  Matrix6 point = Matrix6::Zero();  // the same, did every match hold its point in all directions
  double weights = 0;
  double squares = 0;  // sum w (distance from the plane)^2
  double points = 0;

  void add(const Vector3d& x, const Vector3d& normal, double residual, double weight) noexcept {
    Eigen::Matrix<double, 3, 6> moved;  // derivative of the moved point
    moved << -cross_matrix(x), Matrix3d::Identity();
    const Vector6 j = moved.transpose() * normal;
    plane += weight * j * j.transpose();
    point += weight * moved.transpose() * moved;
    weights += weight;
    squares += weight * residual * residual;
    points += 1;
  }
};

/// The matches of `moving`'s points on `fixed`. `to_target` leads from the frame of `fixed` to the
/// target's. Weights as in refine(): by distance (Geman-McClure) and by agreement of the normals.
void add_matches(const RigidTransform& pose, const Surface& moving, const Surface& fixed,
                 const RigidTransform& to_target, double tolerance, Information& sum) noexcept {
  const Motion motion = to_motion(pose);
  const double limit = tolerance * tolerance;
  Matches m;
  for (Index first = 0; first < moving.count; first += Matches::capacity) {
    match_points(motion, moving, first, std::min(Matches::capacity, moving.count - first), fixed,
                 Search::exact, m);
    for (Index i = 0; i < m.count; ++i) {
      const Vector3d x = at(m.x, m.y, m.z, i);
      const Vector3d normal = at(m.normal_x, m.normal_y, m.normal_z, i);
      const double residual = normal.dot(x - at(m.nearest_x, m.nearest_y, m.nearest_z, i));
      const double near = limit / (limit + static_cast<double>(m.squared[i]));
      sum.add(to_target.rotation * x + to_target.translation, to_target.rotation * normal, residual,
              near * near * static_cast<double>(m.agreement[i]));
    }
  }
}

/// Both ways. One match that holds all directions at distance 1 comes on top, so that there is
/// information where nothing matches.
Information sum_matches(const RigidTransform& pose, const VerifiedWorkspace& v) noexcept {
  const auto spacing = static_cast<double>(v.spacing);
  Information sum;
  sum.point = Matrix6::Identity();
  add_matches(pose, v.surface[0], v.surface[1], {}, spacing, sum);
  add_matches(inverse(pose), v.surface[1], v.surface[0], pose, spacing, sum);
  return sum;
}

/// Least eigenvalue of what the planes tell about the rotation whatever the translation, per match.
double rotation_information(const Information& sum) noexcept {
  const Matrix3d shift =
      sum.plane.bottomRightCorner<3, 3>() + 1e-6 * (1 + sum.weights) * Matrix3d::Identity();
  const Matrix3d mixed = sum.plane.bottomLeftCorner<3, 3>();
  const Matrix3d rotation =
      sum.plane.topLeftCorner<3, 3>() - mixed.transpose() * shift.ldlt().solve(mixed);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(rotation, Eigen::EigenvaluesOnly);
  return std::max(solver.eigenvalues()(0), 0.0) / (1 + sum.weights);
}

/// One error more that all matches share, so that no number of them averages it out. A scan shows
/// one side of a plate, a model both, nearer to each other than its points are: its planes lie
/// between them, and the scan comes to lie on those. How much farther from its planes one cloud's
/// points are than the other's tells by how much. (Validation shapes, single views onto the whole:
/// mean e^T C^-1 e 97 without it, 11 with it; independent samples 3.6 and 3.2.)
Matrix6 with_common_offset(const Matrix6& factor, const VerifiedWorkspace& v) noexcept {
  const double offset = static_cast<double>(v.surface[0].noise - v.surface[1].noise);
  const Matrix6 covariance = factor * factor.transpose() + offset * offset * Matrix6::Identity();
  const Eigen::LLT<Matrix6> solver(covariance);
  return solver.info() == Eigen::Success ? Matrix6(solver.matrixL()) : factor;
}

}  // namespace

Uncertainty measure_uncertainty(const RigidTransform& pose, const VerifiedWorkspace& v) noexcept {
  const Information sum = sum_matches({pose.rotation, pose.translation / v.radius}, v);
  const double spacing_squared = static_cast<double>(v.spacing) * static_cast<double>(v.spacing);
  const double residual_squared = sum.weights > 0 ? sum.squares / sum.weights : spacing_squared;
  double noise_squared = 0;
  for (const Surface& s : v.surface) noise_squared += std::pow(static_cast<double>(s.noise), 2) / 2;

  // In the basis of the solver's vectors `point` is the identity and `plane` is diagonal: how much
  // of what it could hold, the shape holds.
  Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> solver(sum.plane, sum.point);
  const Eigen::Array<double, 6, 1> held = solver.eigenvalues().array().max(0);
  const double tilt = least_tilt + tilt_per_squared_noise * noise_squared / spacing_squared;
  const double variance = variance_per_squared_residual * residual_squared +
                          variance_per_squared_spacing * spacing_squared;
  const double share = std::pow(sum.weights / sum.points, share_power);
  const Eigen::Array<double, 6, 1> information =
      share / variance * held.square() / (held + tilt) + point_information / spacing_squared;

  Uncertainty result;
  const Matrix6 held_by_planes = solver.eigenvectors() * information.rsqrt().matrix().asDiagonal();
  result.factor = with_common_offset(held_by_planes, v);
  result.factor.bottomRows<3>() *= v.radius;
  result.residual = std::sqrt(residual_squared / spacing_squared);
  result.certainty = std::log10(rotation_information(sum) + 1e-6);
  return result;
}

Covariance user_covariance(const Uncertainty& uncertainty, double inflation, double scale,
                           const Cloud& target) noexcept {
  // About the centroid c, a point p goes to exp([w]x)(p - c) + c + v; about the origin, the same
  // motion has the translation v + c - exp([w]x) c, to first order v + c cross w.
  const Matrix3d lever = cross_matrix(Eigen::Map<const Vector3d>(target.centroid));
  Matrix6 factor = std::sqrt(inflation) * uncertainty.factor;
  factor.bottomRows<3>() = scale * factor.bottomRows<3>() + lever * factor.topRows<3>();
  const Matrix6 covariance = factor * factor.transpose();
  // Of clouds beyond 1e150 squares overflow, of clouds below 1e-150 they vanish: a variance of 0
  // would claim certainty.
  const bool known = covariance.allFinite() &&
                     covariance.diagonal().minCoeff() >= std::numeric_limits<double>::min();
  if (!known) return unknown_covariance;
  Covariance result;
  // Symmetric to the last bit: a product sums the terms of (a, b) and (b, a) in the same order, but
  // may fuse them differently.
  Eigen::Map<Matrix6>(result.data()) = covariance.selfadjointView<Eigen::Lower>();
  return result;
}

}  // namespace vnreg::detail
