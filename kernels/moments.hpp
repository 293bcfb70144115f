// What a point sees of its surroundings: moments of a cloud within a radius r of a centre
// (docs/design.md). With weights w = (1 - d^2/r^2)^2 for d < r, else 0, and <> the weighted mean of
// the offsets from the centre, they depend neither on the number of points nor on their order.
#pragma once

#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

inline constexpr Index moment_radii = 3;

struct Moments {
  float offset[3];      // <d> / r
  float covariance[6];  // xx, xy, xz, yy, yz, zz of 4 <d d^T> / r^2 - 4 o o^T
  float skew[3];        // <|d|^2 d> / r^3
};

/// `leaf_bounds` is room for index.leaves() numbers; `centre` one of the points of the index or any
/// place with a point nearer than each radius.
void radius_moments(const SpatialIndex& index, const float centre[3],
                    const float radii[moment_radii], float* leaf_bounds,
                    Moments out[moment_radii]) noexcept;

inline constexpr Index moment_scalars = 18;
inline constexpr Index local_vectors = 21;
inline constexpr Index context_vectors = 8;

/// A vector per row: v[i] is row i.
using Vector3f = Eigen::Vector3f;

struct MomentFeatures {
  float scalars[moment_scalars];
  Vector3f local[local_vectors];
  Vector3f context[context_vectors];
};

/// Invariants and equivariant vectors of the moments about `centre` (about the cloud's centroid).
void moment_features(const Moments moments[moment_radii], const float centre[3],
                     MomentFeatures& out) noexcept;

}  // namespace vnreg::kernels
