// How well a pose fits: the symmetric nearest-point measure of both clouds.
#pragma once

#include "engine/workspace.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

struct Residual {              // lengths in network coordinates
  double inlier_distance = 0;  // twice the median spacing of the sparser cloud
  double overlap = 0;          // share of the points of both clouds that are inliers
  double rmse = 0;             // of the inliers
};

/// Moves each cloud onto the other and measures the distance of every point to its nearest.
Residual measure_residual(const kernels::RigidTransform& pose, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
