// The direction of least variance of many 3 x 3 covariance matrices at once.
#pragma once

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Symmetric matrices, one array of numbers for each entry.
struct SymmetricArrays {
  const float *xx, *xy, *xz, *yy, *yz, *zz;
};

/// Unit vectors (x[i], y[i], z[i]), of either sign, to the least eigenvalue of each of `count`
/// finite, positive semidefinite matrices. Where the two least eigenvalues agree, any in their
/// plane.
void least_directions(const SymmetricArrays& matrices, Index count, float* x, float* y,
                      float* z) noexcept;

}  // namespace vnreg::kernels
