// How far a pose that is right may still be off: the covariance of its error, from the matches of
// both surfaces at that pose.
#pragma once

#include "engine/cloud.hpp"
#include "engine/verified_workspace.hpp"
#include "kernels/procrustes.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// What the matches of both surfaces tell about a pose. The error is (rotation vector,
/// translation), a perturbation from the left about the target's centroid, in network coordinates.
struct Uncertainty {
  Matrix6 factor;        // covariance = factor * factor^T
  double residual = 0;   // r.m.s. distance of matched points from the planes, in spacings
  double certainty = 0;  // log10 of the least eigenvalue of the information that a match gives on
                         // the rotation, per plane variance, in radii^2
};

/// `pose` in network coordinates; the workspace's surfaces must be those of the pair. Finite.
Uncertainty measure_uncertainty(const kernels::RigidTransform& pose,
                                const VerifiedWorkspace& workspace) noexcept;

/// In the user's units and about the user's origin, times `inflation`. All NaN where the target is
/// so far from its origin that float64 cannot hold it.
Covariance user_covariance(const Uncertainty& uncertainty, double inflation, double scale,
                           const Cloud& target) noexcept;

}  // namespace vnreg::detail
