#include "kernels/vn_relu.hpp"

namespace vnreg::kernels {
namespace {

/// -<v,d> / (|d|^2 + eps) where <v,d> is negative, else 0: v + share * d is the result.
inline float share_of_direction(float dot, float squared_norm) noexcept {
  return -(dot < 0.0f ? dot : 0.0f) / (squared_norm + vn_epsilon);
}

}  // namespace

void vn_relu(Index points, Index channels, VectorsView v, MutableVectorsView d) noexcept {
  for (Index p = 0; p < points; ++p) {
    const float* vx = v.at(p, 0);
    const float* vy = v.at(p, 1);
    const float* vz = v.at(p, 2);
    float* dx = d.at(p, 0);
    float* dy = d.at(p, 1);
    float* dz = d.at(p, 2);
#pragma omp simd
    for (Index c = 0; c < channels; ++c) {
      const float dot = vx[c] * dx[c] + vy[c] * dy[c] + vz[c] * dz[c];
      const float squared_norm = dx[c] * dx[c] + dy[c] * dy[c] + dz[c] * dz[c];
      const float share = share_of_direction(dot, squared_norm);
      dx[c] = vx[c] + share * dx[c];
      dy[c] = vy[c] + share * dy[c];
      dz[c] = vz[c] + share * dz[c];
    }
  }
}

void vn_relu_shared(Index points, Index channels, VectorsView v, VectorsView d,
                    MutableVectorsView out) noexcept {
  for (Index p = 0; p < points; ++p) {
    const float* vx = v.at(p, 0);
    const float* vy = v.at(p, 1);
    const float* vz = v.at(p, 2);
    const float dx = *d.at(p, 0);
    const float dy = *d.at(p, 1);
    const float dz = *d.at(p, 2);
    float* ox = out.at(p, 0);
    float* oy = out.at(p, 1);
    float* oz = out.at(p, 2);
    const float squared_norm = dx * dx + dy * dy + dz * dz;
    const float inverse = 1.0f / (squared_norm + vn_epsilon);
#pragma omp simd
    for (Index c = 0; c < channels; ++c) {
      const float dot = vx[c] * dx + vy[c] * dy + vz[c] * dz;
      const float share = -(dot < 0.0f ? dot : 0.0f) * inverse;
      ox[c] = vx[c] + share * dx;
      oy[c] = vy[c] + share * dy;
      oz[c] = vz[c] + share * dz;
    }
  }
}

}  // namespace vnreg::kernels
