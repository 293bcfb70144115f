// Weighted sums of the powers of the offsets of points near a place: what moments.cpp and
// surroundings.cpp are made of.
#pragma once

#include "kernels/list_within.hpp"
#include "kernels/packets.hpp"
#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

/// One lane per place in a packet of points; the sum is over the lanes.
struct PowerSums {
  Packet weight = zero(), x = zero(), y = zero(), z = zero();
  Packet xx = zero(), xy = zero(), xz = zero(), yy = zero(), yz = zero(), zz = zero();

  static Packet zero() noexcept { return Eigen::internal::pset1<Packet>(0.0f); }

  /// The covariance's 6 numbers xx, xy, xz, yy, yz, zz, scaled as docs/design.md has them: 4 (s
  /// times the second powers, less the offset's products).
  void covariance(float scale, const float offset[3], float out[6]) const noexcept {
    using Eigen::internal::predux;
    const float second[6] = {predux(xx), predux(xy), predux(xz),
                             predux(yy), predux(yz), predux(zz)};
    constexpr Index row[6] = {0, 0, 0, 1, 1, 2};
    constexpr Index column[6] = {0, 1, 2, 1, 2, 2};
    for (Index i = 0; i < 6; ++i) {
      out[i] = 4.0f * (scale * second[i] - offset[row[i]] * offset[column[i]]);
    }
  }

  void offset(float scale, float out[3]) const noexcept {
    using Eigen::internal::predux;
    out[0] = scale * predux(x);
    out[1] = scale * predux(y);
    out[2] = scale * predux(z);
  }
};

/// Over the points of the leaves that reach into the sphere about the centre, with weights
/// (1 - d^2 / r^2)^2. also(wx, wy, wz, squared) is told each packet's weighted offsets and its
/// squared distances, r^2 at the most.
template <class Also>
PowerSums sum_within(const SpatialIndex& index, const float* leaf_bounds, const float centre[3],
                     float radius_squared, const Also& also) noexcept {
  using namespace Eigen::internal;
  static_assert(SpatialIndex::leaf_size % packet_size == 0);
  const Packet cx = pset1<Packet>(centre[0]), cy = pset1<Packet>(centre[1]);
  const Packet cz = pset1<Packet>(centre[2]);
  const Packet limit = pset1<Packet>(radius_squared);
  const Packet inverse = pset1<Packet>(1.0f / radius_squared);
  const Coordinates points = index.ordered();
  PowerSums s;
  for_each_listed(leaf_bounds, index.leaves(), radius_squared, [&](Index leaf) {
    const Index first = leaf * SpatialIndex::leaf_size;
    for (Index i = first; i < first + SpatialIndex::leaf_size; i += packet_size) {
      const Packet dx = psub(ploadu<Packet>(points.x + i), cx);
      const Packet dy = psub(ploadu<Packet>(points.y + i), cy);
      const Packet dz = psub(ploadu<Packet>(points.z + i), cz);
      const Packet distance = pmadd(dz, dz, pmadd(dy, dy, pmul(dx, dx)));
      // Cut at r, where the weight is exactly zero: the padding of the last leaf is at 1e30.
      const Packet squared = pmin(distance, limit);
      const Packet root = pmul(psub(limit, squared), inverse);
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
      also(wx, wy, wz, squared);
    }
  });
  return s;
}

}  // namespace vnreg::kernels
