#include "kernels/surroundings.hpp"

namespace vnreg::kernels {
namespace {

constexpr float least_weight = 1e-3f;
constexpr Index lanes = SpatialIndex::leaf_size;
constexpr Index moments = 10;  // 1, x, y, z, xx, xy, xz, yy, yz, zz

/// One lane per place in a leaf.
struct Sums {
  alignas(64) float of[moments][lanes] = {};

  void add(const float* px, const float* py, const float* pz, const float centre[3],
           float radius_squared, float inverse) noexcept {
    const float cx = centre[0], cy = centre[1], cz = centre[2];
#pragma omp simd
    for (Index i = 0; i < lanes; ++i) {
      const float dx = px[i] - cx, dy = py[i] - cy, dz = pz[i] - cz;
      const float distance = dx * dx + dy * dy + dz * dz;
      // Cut at r, where the weight is exactly zero: the padding of the last leaf is at 1e30.
      const float squared = distance < radius_squared ? distance : radius_squared;
      const float root = (radius_squared - squared) * inverse;
      const float w = root * root;
      const float wx = w * dx, wy = w * dy, wz = w * dz;
      of[0][i] += w;
      of[1][i] += wx;
      of[2][i] += wy;
      of[3][i] += wz;
      of[4][i] += wx * dx;
      of[5][i] += wx * dy;
      of[6][i] += wx * dz;
      of[7][i] += wy * dy;
      of[8][i] += wy * dz;
      of[9][i] += wz * dz;
    }
  }

  float total(Index moment) const noexcept {
    return Eigen::Map<const Eigen::Array<float, lanes, 1>, Eigen::Aligned64>(of[moment]).sum();
  }
};

Surroundings finish(const Sums& s, float radius, Index count) noexcept {
  Surroundings out;
  const float weight = s.total(0);
  out.weight = weight / static_cast<float>(count);
  const float per_radius = 1.0f / ((weight + least_weight) * radius);
  for (Index i = 0; i < 3; ++i) out.offset[i] = per_radius * s.total(1 + i);
  constexpr Index row[6] = {0, 0, 0, 1, 1, 2};
  constexpr Index column[6] = {0, 1, 2, 1, 2, 2};
  for (Index i = 0; i < 6; ++i) {
    const float second = per_radius / radius * s.total(4 + i);
    out.covariance[i] = 4.0f * (second - out.offset[row[i]] * out.offset[column[i]]);
  }
  return out;
}

}  // namespace

void surroundings(const SpatialIndex& index, const float centre[3],
                  const float radii[surroundings_radii], float* leaf_bounds,
                  Surroundings out[surroundings_radii]) noexcept {
  index.leaf_bounds(centre[0], centre[1], centre[2], leaf_bounds);
  const Coordinates points = index.ordered();
  for (Index i = 0; i < surroundings_radii; ++i) {
    const float squared = radii[i] * radii[i];
    const float inverse = 1.0f / squared;
    Sums sums;
    for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
      if (!(leaf_bounds[leaf] < squared)) continue;
      const Index first = leaf * lanes;
      sums.add(points.x + first, points.y + first, points.z + first, centre, squared, inverse);
    }
    out[i] = finish(sums, radii[i], index.count());
  }
}

}  // namespace vnreg::kernels
