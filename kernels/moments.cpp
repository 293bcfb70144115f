#include "kernels/moments.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "kernels/power_sums.hpp"

namespace vnreg::kernels {
namespace {

using Eigen::internal::pmadd;
using Eigen::internal::predux;

using Matrix3f = Eigen::Matrix3f;

constexpr float small = 1e-4f;  // keeps ratios of the moments of an isolated point finite

Moments moments_within(const SpatialIndex& index, const float* leaf_bounds, const float centre[3],
                       float radius) noexcept {
  Packet cubic_x = PowerSums::zero(), cubic_y = cubic_x, cubic_z = cubic_x;
  const auto add_cubic = [&](Packet wx, Packet wy, Packet wz, Packet squared) {
    cubic_x = pmadd(wx, squared, cubic_x);
    cubic_y = pmadd(wy, squared, cubic_y);
    cubic_z = pmadd(wz, squared, cubic_z);
  };
  const PowerSums s = sum_within(index, leaf_bounds, centre, radius * radius, add_cubic);
  const float share = 1.0f / predux(s.weight);
  const float per_radius = share / radius;
  Moments m;
  s.offset(per_radius, m.offset);
  s.covariance(per_radius / radius, m.offset, m.covariance);
  const float per_cube = per_radius / (radius * radius);
  m.skew[0] = per_cube * predux(cubic_x);
  m.skew[1] = per_cube * predux(cubic_y);
  m.skew[2] = per_cube * predux(cubic_z);
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
    out[i] = moments_within(index, leaf_bounds, centre, radii[i]);
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
