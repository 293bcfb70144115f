// A rigid motion in float32, for the many that are only tried.
#pragma once

#include "kernels/procrustes.hpp"

namespace vnreg::detail {

struct Motion {
  float rotation[9];  // row-major
  float translation[3];
};

inline Motion to_motion(const kernels::RigidTransform& transform) noexcept {
  Motion motion;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      motion.rotation[3 * row + column] = static_cast<float>(transform.rotation(row, column));
    }
    motion.translation[row] = static_cast<float>(transform.translation(row));
  }
  return motion;
}

inline Motion inverse(const Motion& m) noexcept {
  Motion back;
  for (int row = 0; row < 3; ++row) {
    float moved = 0;
    for (int column = 0; column < 3; ++column) {
      back.rotation[3 * row + column] = m.rotation[3 * column + row];
      moved += m.rotation[3 * column + row] * m.translation[column];
    }
    back.translation[row] = -moved;
  }
  return back;
}

/// Whether the motions differ by less than the angle whose cosine is given, and by less than the
/// distance.
inline bool similar(const Motion& a, const Motion& b, float cosine, float distance) noexcept {
  float trace = 0;
  for (int i = 0; i < 9; ++i) trace += a.rotation[i] * b.rotation[i];
  float squared = 0;
  for (int i = 0; i < 3; ++i) {
    const float d = a.translation[i] - b.translation[i];
    squared += d * d;
  }
  return (trace - 1) / 2 > cosine && squared < distance * distance;
}

}  // namespace vnreg::detail
