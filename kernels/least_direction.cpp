#include "kernels/least_direction.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace vnreg::kernels {
namespace {

// Newton's steps from 0 towards the least root of the characteristic polynomial: it is concave
// there, so they never pass the root, and ten leave next to nothing, even of a double root.
constexpr int newton_steps = 10;
// Squared length, for a matrix of trace 1, of a product of two rows that fixes the direction.
constexpr double least_product = 1e-20;

constexpr Index chunk = 64;

struct Directions {
  alignas(64) double x[chunk], y[chunk], z[chunk];
  alignas(64) double squared[chunk];  // length of the product that they are taken from
};

void find_directions(const SymmetricArrays& m, Index first, Index count, Directions& d) noexcept {
#pragma omp simd
  for (Index i = 0; i < count; ++i) {
    const Index at = first + i;
    const auto xx = static_cast<double>(m.xx[at]), yy = static_cast<double>(m.yy[at]);
    const auto zz = static_cast<double>(m.zz[at]);
    const double scale = 1.0 / (xx + yy + zz + 1e-300);
    const double a = scale * xx, b = scale * static_cast<double>(m.xy[at]);
    const double c = scale * static_cast<double>(m.xz[at]), e = scale * yy;
    const double f = scale * static_cast<double>(m.yz[at]), g = scale * zz;
    const double minors = (a * e - b * b) + (a * g - c * c) + (e * g - f * f);
    const double determinant = a * (e * g - f * f) - b * (b * g - f * c) + c * (b * f - e * c);
    double root = 0;
    for (int k = 0; k < newton_steps; ++k) {
      const double value = ((root - 1) * root + minors) * root - determinant;
      const double slope = (3 * root - 2) * root + minors;
      const double step = value / (slope + 1e-300);
      root = slope > 0 ? root - step : root;
    }
    // The rows of A - root I lie across the direction; of their three cross products the longest.
    const double p = a - root, q = e - root, r = g - root;
    const double ux = b * f - c * q, uy = c * b - p * f, uz = p * q - b * b;
    const double vx = b * r - c * f, vy = c * c - p * r, vz = p * f - b * c;
    const double wx = q * r - f * f, wy = f * c - b * r, wz = b * f - q * c;
    const double u = ux * ux + uy * uy + uz * uz;
    const double v = vx * vx + vy * vy + vz * vz;
    const double w = wx * wx + wy * wy + wz * wz;
    const bool second = v > u;
    const double longer = second ? v : u;
    const bool third = w > longer;
    d.x[i] = third ? wx : second ? vx : ux;
    d.y[i] = third ? wy : second ? vy : uy;
    d.z[i] = third ? wz : second ? vz : uz;
    d.squared[i] = third ? w : longer;
  }
}

Eigen::Vector3d solved(const SymmetricArrays& m, Index at) noexcept {
  Eigen::Matrix3f matrix;
  matrix << m.xx[at], m.xy[at], m.xz[at], m.xy[at], m.yy[at], m.yz[at], m.xz[at], m.yz[at],
      m.zz[at];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(matrix.cast<double>());
  return solver.eigenvectors().col(0);
}

}  // namespace

void least_directions(const SymmetricArrays& matrices, Index count, float* x, float* y,
                      float* z) noexcept {
  Directions d;
  for (Index first = 0; first < count; first += chunk) {
    const Index some = std::min(chunk, count - first);
    find_directions(matrices, first, some, d);
    for (Index i = 0; i < some; ++i) {
      Eigen::Vector3d direction(d.x[i], d.y[i], d.z[i]);
      if (d.squared[i] > least_product) {
        direction /= std::sqrt(d.squared[i]);
      } else {
        direction = solved(matrices, first + i);
      }
      x[first + i] = static_cast<float>(direction.x());
      y[first + i] = static_cast<float>(direction.y());
      z[first + i] = static_cast<float>(direction.z());
    }
  }
}

}  // namespace vnreg::kernels
