// From network coordinates back to the user's units and origins.
#pragma once

#include "engine/cloud.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

/// t_user = c_target + s t - R c_source; `scale` s is the length that is 1 in network coordinates.
inline Pose user_pose(const kernels::RigidTransform& network, double scale,
                      const Cloud cloud[2]) noexcept {
  const Eigen::Vector3d source = Eigen::Map<const Eigen::Vector3d>(cloud[0].centroid);
  const Eigen::Vector3d target = Eigen::Map<const Eigen::Vector3d>(cloud[1].centroid);
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = decltype(matrix)::Identity();
  matrix.topLeftCorner<3, 3>() = network.rotation;
  matrix.topRightCorner<3, 1>() = target + scale * network.translation - network.rotation * source;
  Pose pose;
  Eigen::Map<decltype(matrix)>(pose.data()) = matrix;
  return pose;
}

}  // namespace vnreg::detail
