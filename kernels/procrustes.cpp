#include "kernels/procrustes.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace vnreg::kernels {
namespace {

inline Eigen::Vector3d vector_at(const Coordinates& c, Index i) noexcept {
  return {static_cast<double>(c.x[i]), static_cast<double>(c.y[i]), static_cast<double>(c.z[i])};
}

inline double weight_at(const float* weights, Index i) noexcept {
  return weights == nullptr ? 1.0 : static_cast<double>(weights[i]);
}

}  // namespace

RigidTransform compose(const RigidTransform& a, const RigidTransform& b) noexcept {
  return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
}

RotationFit fit_rotation(const Eigen::Matrix3d& h) noexcept {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(h, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1.0;
  return {u * svd.matrixV().transpose(), svd.singularValues()};
}

ProcrustesSolution procrustes(const Coordinates& x, const Coordinates& y, const float* weights,
                              Index count) noexcept {
  Eigen::Vector3d mean_x = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_y = Eigen::Vector3d::Zero();
  double total = 0;
  for (Index i = 0; i < count; ++i) {
    const double w = weight_at(weights, i);
    mean_x += w * vector_at(x, i);
    mean_y += w * vector_at(y, i);
    total += w;
  }
  if (!(total > 0)) return {};
  mean_x /= total;
  mean_y /= total;
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  for (Index i = 0; i < count; ++i) {
    h +=
        weight_at(weights, i) * (vector_at(y, i) - mean_y) * (vector_at(x, i) - mean_x).transpose();
  }
  if (!h.allFinite() || !mean_x.allFinite() || !mean_y.allFinite()) return {};
  const RotationFit fit = fit_rotation(h);
  return {{fit.rotation, mean_y - fit.rotation * mean_x}, fit.singular_values};
}

}  // namespace vnreg::kernels
