#include "engine/rigid.hpp"

#include <Eigen/Geometry>

namespace vnreg::detail {

void move_points(const kernels::RigidTransform& transform, const kernels::Coordinates& points,
                 kernels::Index count, float* x, float* y, float* z) noexcept {
  const Eigen::Matrix3d& r = transform.rotation;
  const Eigen::Vector3d& t = transform.translation;
  for (kernels::Index i = 0; i < count; ++i) {
    const auto px = static_cast<double>(points.x[i]);
    const auto py = static_cast<double>(points.y[i]);
    const auto pz = static_cast<double>(points.z[i]);
    x[i] = static_cast<float>(r(0, 0) * px + r(0, 1) * py + r(0, 2) * pz + t(0));
    y[i] = static_cast<float>(r(1, 0) * px + r(1, 1) * py + r(1, 2) * pz + t(1));
    z[i] = static_cast<float>(r(2, 0) * px + r(2, 1) * py + r(2, 2) * pz + t(2));
  }
}

kernels::RigidTransform orthonormal(const kernels::RigidTransform& transform) noexcept {
  return {Eigen::Quaterniond(transform.rotation).normalized().toRotationMatrix(),
          transform.translation};
}

kernels::RigidTransform inverse(const kernels::RigidTransform& transform) noexcept {
  const Eigen::Matrix3d back = transform.rotation.transpose();
  return {back, -(back * transform.translation)};
}

}  // namespace vnreg::detail
