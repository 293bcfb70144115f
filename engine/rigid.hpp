// Rigid motions applied to points.
#pragma once

#include "kernels/procrustes.hpp"

namespace vnreg::detail {

/// out = R p + t for `count` points, computed in float64.
void move_points(const kernels::RigidTransform& transform, const kernels::Coordinates& points,
                 kernels::Index count, float* x, float* y, float* z) noexcept;

/// The same motion with a rotation to the last bit of float64: of products, or of float32, rounding
/// is left.
kernels::RigidTransform orthonormal(const kernels::RigidTransform& transform) noexcept;

/// The motion back.
kernels::RigidTransform inverse(const kernels::RigidTransform& transform) noexcept;

}  // namespace vnreg::detail
