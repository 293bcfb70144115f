// Many rotation fits at once (procrustes.hpp fits one), for hypotheses that are only tried.
#pragma once

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Up to `capacity` 3 x 3 matrices or rotations, an array for each entry, row by row.
struct MatrixBatch {
  static constexpr Index capacity = 64;
  alignas(64) double entry[9][capacity];
};

/// The rotations R that maximise trace(R^T H), to within 1e-6 of H's singular values' sum, for the
/// first `count` matrices H = sum y x^T, finite.
/// determined[i] is false, and the rotation any, where H fixes none: its two least singular values
/// cancel, or there is but one, to within 3e-4 of the largest.
void fit_rotations(const MatrixBatch& h, Index count, MatrixBatch& rotation,
                   bool determined[MatrixBatch::capacity]) noexcept;

}  // namespace vnreg::kernels
