#include "kernels/moments.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace vnreg::kernels {
namespace {

using Matrix3f = Eigen::Matrix3f;

constexpr float small = 1e-4f;  // keeps ratios of the moments of an isolated point finite
constexpr Index lanes = SpatialIndex::leaf_size;

/// Weighted sums of the powers of the offsets, one lane per place in a leaf.
struct Sums {
  alignas(64) float weight[lanes] = {}, x[lanes] = {}, y[lanes] = {}, z[lanes] = {};
  alignas(64) float xx[lanes] = {}, xy[lanes] = {}, xz[lanes] = {};
  alignas(64) float yy[lanes] = {}, yz[lanes] = {}, zz[lanes] = {};
  alignas(64) float cubic_x[lanes] = {}, cubic_y[lanes] = {}, cubic_z[lanes] = {};

  /// Adds the points of a leaf, whose coordinates start at px, py, pz.
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
      weight[i] += w;
      x[i] += wx;
      y[i] += wy;
      z[i] += wz;
      xx[i] += wx * dx;
      xy[i] += wx * dy;
      xz[i] += wx * dz;
      yy[i] += wy * dy;
      yz[i] += wy * dz;
      zz[i] += wz * dz;
      cubic_x[i] += wx * squared;
      cubic_y[i] += wy * squared;
      cubic_z[i] += wz * squared;
    }
  }
};

float total(const float* values) noexcept {
  return Eigen::Map<const Eigen::Array<float, lanes, 1>, Eigen::Aligned64>(values).sum();
}

Moments finish(const Sums& s, float radius) noexcept {
  const float share = 1.0f / total(s.weight);
  const float per_radius = share / radius;
  Moments m;
  m.offset[0] = per_radius * total(s.x);
  m.offset[1] = per_radius * total(s.y);
  m.offset[2] = per_radius * total(s.z);
  const float* second[6] = {s.xx, s.xy, s.xz, s.yy, s.yz, s.zz};
  constexpr Index row[6] = {0, 0, 0, 1, 1, 2};
  constexpr Index column[6] = {0, 1, 2, 1, 2, 2};
  for (Index i = 0; i < 6; ++i) {
    m.covariance[i] =
        4.0f * (per_radius / radius * total(second[i]) - m.offset[row[i]] * m.offset[column[i]]);
  }
  const float per_cube = per_radius / (radius * radius);
  m.skew[0] = per_cube * total(s.cubic_x);
  m.skew[1] = per_cube * total(s.cubic_y);
  m.skew[2] = per_cube * total(s.cubic_z);
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
  const Coordinates points = index.ordered();
  for (Index i = 0; i < moment_radii; ++i) {
    const float squared = radii[i] * radii[i];
    const float inverse = 1.0f / squared;
    Sums sums;
    for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
      if (!(leaf_bounds[leaf] < squared)) continue;
      const Index first = leaf * lanes;
      sums.add(points.x + first, points.y + first, points.z + first, centre, squared, inverse);
    }
    out[i] = finish(sums, radii[i]);
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
