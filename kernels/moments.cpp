#include "kernels/moments.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

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

using Matrix3f = Eigen::Matrix3f;

constexpr float small = 1e-4f;  // keeps ratios of the moments of an isolated point finite
static_assert(SpatialIndex::leaf_size % packet_size == 0);

/// Weighted sums of the powers of the offsets, one lane per place in a packet
/// of points.
struct Sums {
  Packet weight = zero(), x = zero(), y = zero(), z = zero();
  Packet xx = zero(), xy = zero(), xz = zero(), yy = zero(), yz = zero(), zz = zero();
  Packet cubic_x = zero(), cubic_y = zero(), cubic_z = zero();

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
      // Cut at r, where the weight is exactly zero: the padding of the last
      // leaf is at 1e30.
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
      s.cubic_x = pmadd(wx, squared, s.cubic_x);
      s.cubic_y = pmadd(wy, squared, s.cubic_y);
      s.cubic_z = pmadd(wz, squared, s.cubic_z);
    }
  });
  return s;
}

Moments finish(const Sums& s, float radius) noexcept {
  const float share = 1.0f / predux(s.weight);
  const float per_radius = share / radius;
  Moments m;
  m.offset[0] = per_radius * predux(s.x);
  m.offset[1] = per_radius * predux(s.y);
  m.offset[2] = per_radius * predux(s.z);
  const float second[6] = {predux(s.xx), predux(s.xy), predux(s.xz),
                           predux(s.yy), predux(s.yz), predux(s.zz)};
  constexpr Index row[6] = {0, 0, 0, 1, 1, 2};
  constexpr Index column[6] = {0, 1, 2, 1, 2, 2};
  for (Index i = 0; i < 6; ++i) {
    m.covariance[i] =
        4.0f * (per_radius / radius * second[i] - m.offset[row[i]] * m.offset[column[i]]);
  }
  const float per_cube = per_radius / (radius * radius);
  m.skew[0] = per_cube * predux(s.cubic_x);
  m.skew[1] = per_cube * predux(s.cubic_y);
  m.skew[2] = per_cube * predux(s.cubic_z);
  return m;
}

Matrix3f symmetric(const float c[6]) noexcept {
  Matrix3f m;
  m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return m;
}

constexpr Index pairs[3][2] = {{0, 1}, {1, 2}, {0, 2}};

/// The moments of all radii as Eigen's types, and what several features share.
struct View {
  Vector3f offset[moment_radii], skew[moment_radii];
  Matrix3f covariance[moment_radii];
  float trace[moment_radii];

  explicit View(const Moments moments[moment_radii]) noexcept {
    for (Index i = 0; i < moment_radii; ++i) {
      offset[i] = Eigen::Map<const Vector3f>(moments[i].offset);
      skew[i] = Eigen::Map<const Vector3f>(moments[i].skew);
      covariance[i] = symmetric(moments[i].covariance);
      trace[i] = covariance[i].trace();
    }
  }
};

void write_scalars(const View& m, float* out) noexcept {
  for (Index i = 0; i < moment_radii; ++i) {
    const float trace = m.trace[i];
    *out++ = trace;
    *out++ = m.covariance[i].squaredNorm() / (trace * trace + small);
    *out++ = 27.0f * m.covariance[i].determinant() / (trace * trace * trace + small);
    *out++ = std::sqrt(m.offset[i].squaredNorm() + small);
  }
  for (const auto& [a, b] : pairs) *out++ = m.offset[a].dot(m.offset[b]);
  for (const auto& [a, b] : pairs) {
    const float product = m.covariance[a].cwiseProduct(m.covariance[b]).sum();
    *out++ = product / (m.trace[a] * m.trace[b] + small);
  }
}

void write_local(const View& m, Vector3f* out) noexcept {
  Vector3f turned[moment_radii][moment_radii];
  for (Index i = 0; i < moment_radii; ++i) *out++ = m.offset[i];
  for (Index i = 0; i < moment_radii; ++i) *out++ = m.skew[i];
  for (Index a = 0; a < moment_radii; ++a) {
    for (Index b = 0; b < moment_radii; ++b) {
      turned[a][b] = m.covariance[a] * m.offset[b];
      *out++ = turned[a][b];
    }
  }
  for (const auto& [a, b] : pairs) *out++ = m.offset[a].cross(m.offset[b]);
  for (const auto& [a, b] : pairs) *out++ = turned[a][b].cross(m.offset[b]);
}

void write_context(const View& m, const Vector3f& centre, Vector3f* out) noexcept {
  *out++ = centre;
  for (Index i = 0; i < moment_radii; ++i) *out++ = m.covariance[i] * centre;
  for (Index i = 0; i < moment_radii; ++i) *out++ = m.offset[i].cross(centre);
  *out++ = (m.covariance[1] * centre).cross(centre);
}

}  // namespace

void radius_moments(const SpatialIndex& index, const float centre[3],
                    const float radii[moment_radii], float* leaf_bounds,
                    Moments out[moment_radii]) noexcept {
  index.leaf_bounds(centre[0], centre[1], centre[2], leaf_bounds);
  for (Index i = 0; i < moment_radii; ++i) {
    out[i] = finish(sum_within(index, leaf_bounds, centre, radii[i] * radii[i]), radii[i]);
  }
}

void moment_features(const Moments moments[moment_radii], const float centre[3],
                     MomentFeatures& out) noexcept {
  const View view(moments);
  write_scalars(view, out.scalars);
  write_local(view, out.local);
  write_context(view, Eigen::Map<const Vector3f>(centre), out.context);
}

}  // namespace vnreg::kernels
