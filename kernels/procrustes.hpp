// Orthogonal Procrustes (paper, section III-C): the rigid motion that best maps paired points x to
// y,
//   H = sum w (y - mean y)(x - mean x)^T = U S V^T,  R = U diag(1, 1, det(U V^T)) V^T,
//   t = mean y - R mean x,
// in float64, with weighted means in both.
#pragma once

#include <Eigen/Core>

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

/// The transform that does b first, then a.
RigidTransform compose(const RigidTransform& a, const RigidTransform& b) noexcept;

struct RotationFit {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d singular_values;  // of H, descending; the second is 0: no rotation is determined
};

/// The rotation R that maximises trace(R^T H) for H = sum y x^T, finite.
RotationFit fit_rotation(const Eigen::Matrix3d& h) noexcept;

struct ProcrustesSolution {
  RigidTransform transform;                                   // y = R x + t
  Eigen::Vector3d singular_values = Eigen::Vector3d::Zero();  // of H, descending
};

/// `weights` (non-negative) may be null: all equal. With weights that sum to 0, or numbers that are
/// not finite, the transform is the identity and the singular values are 0.
ProcrustesSolution procrustes(const Coordinates& x, const Coordinates& y, const float* weights,
                              Index count) noexcept;

}  // namespace vnreg::kernels
