#include "kernels/surroundings.hpp"

#include "kernels/list_within.hpp"

namespace vnreg::kernels {
namespace {

using Eigen::internal::padd;
using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::pmin;
using Eigen::internal::pmul;
using Eigen::internal::predux;
using Eigen::internal::pset1;
using Eigen::internal::psub;

constexpr float least_weight = 1e-3f;
static_assert(SpatialIndex::leaf_size % packet_size == 0);

/// Weighted sums of the powers of the offsets, one lane per place in a packet of points.
struct Sums {
  Packet weight = zero(), x = zero(), y = zero(), z = zero();
  Packet xx = zero(), xy = zero(), xz = zero(), yy = zero(), yz = zero(), zz = zero();

  static Packet zero() noexcept { return pset1<Packet>(0.0f); }
};

/// The points of the leaves that reach into the sphere about the centre.
Sums sum_within(const SpatialIndex& index, const float* leaf_bounds, const float centre[3],
                float radius_squared) noexcept {
  const Packet cx = pset1<Packet>(centre[0]), cy = pset1<Packet>(centre[1]);
  const Packet cz = pset1<Packet>(centre[2]);
  const Packet limit = pset1<Packet>(radius_squared);
  const Packet inverse = pset1<Packet>(1.0f / radius_squared);
  const Coordinates points = index.ordered();
  Sums s;
  for_each_listed(leaf_bounds, index.leaves(), radius_squared, [&](Index leaf) {
    const Index first = leaf * SpatialIndex::leaf_size;
    for (Index i = first; i < first + SpatialIndex::leaf_size; i += packet_size) {
      const Packet dx = psub(ploadu<Packet>(points.x + i), cx);
      const Packet dy = psub(ploadu<Packet>(points.y + i), cy);
      const Packet dz = psub(ploadu<Packet>(points.z + i), cz);
      const Packet distance = pmadd(dz, dz, pmadd(dy, dy, pmul(dx, dx)));
      // Cut at r, where the weight is exactly zero: the padding of the last leaf is at 1e30.
      const Packet root = pmul(psub(limit, pmin(distance, limit)), inverse);
      const Packet w = pmul(root, root);
      const Packet wx = pmul(w, dx), wy = pmul(w, dy), wz = pmul(w, dz);
      s.weight = padd(s.weight, w);
      s.x = padd(s.x, wx);
      s.y = padd(s.y, wy);
      s.z = padd(s.z, wz);
      s.xx = pmadd(wx, dx, s.xx);
      s.xy = pmadd(wx, dy, s.xy);
      s.xz = pmadd(wx, dz, s.xz);
      s.yy = pmadd(wy, dy, s.yy);
      s.yz = pmadd(wy, dz, s.yz);
      s.zz = pmadd(wz, dz, s.zz);
    }
  });
  return s;
}

Surroundings finish(const Sums& s, float radius, Index count) noexcept {
  Surroundings out;
  const float weight = predux(s.weight);
  out.weight = weight / static_cast<float>(count);
  const float per_radius = 1.0f / ((weight + least_weight) * radius);
  out.offset[0] = per_radius * predux(s.x);
  out.offset[1] = per_radius * predux(s.y);
  out.offset[2] = per_radius * predux(s.z);
  const float seconds[6] = {predux(s.xx), predux(s.xy), predux(s.xz),
                            predux(s.yy), predux(s.yz), predux(s.zz)};
  constexpr Index row[6] = {0, 0, 0, 1, 1, 2};
  constexpr Index column[6] = {0, 1, 2, 1, 2, 2};
  for (Index i = 0; i < 6; ++i) {
    const float second = per_radius / radius * seconds[i];
    out.covariance[i] = 4.0f * (second - out.offset[row[i]] * out.offset[column[i]]);
  }
  return out;
}

}  // namespace

void surroundings(const SpatialIndex& index, const float centre[3],
                  const float radii[surroundings_radii], float* leaf_bounds,
                  Surroundings out[surroundings_radii]) noexcept {
  index.leaf_bounds(centre[0], centre[1], centre[2], leaf_bounds);
  for (Index i = 0; i < surroundings_radii; ++i) {
    const float squared = radii[i] * radii[i];
    out[i] = finish(sum_within(index, leaf_bounds, centre, squared), radii[i], index.count());
  }
}

}  // namespace vnreg::kernels
