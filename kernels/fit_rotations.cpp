#include "kernels/fit_rotations.hpp"

#include <cmath>

namespace vnreg::kernels {
namespace {

// Newton's steps from an upper bound down to the largest root: convex there, so none passes it.
constexpr int newton_steps = 14;
// Of the slope at the root, relative to the cube of the root: 4 (s2 + s3) (s1 + s2) (s1 + s3) for
// singular values s1 >= s2 >= |s3|. Where it vanishes the root is double or triple, and the steps
// that halve the way to it, or leave two thirds, end at a slope of up to 4e-4.
constexpr double least_slope = 1e-3;
// Of the squared entries' sum: what is below counts as the zero matrix.
constexpr double least_squares = 1e-200;

/// The largest eigenvalue of Davenport's matrix K, whose characteristic polynomial is
/// t^4 + quadratic t^2 + linear t + constant; `bound` is no smaller.
inline double largest_root(double quadratic, double linear, double constant,
                           double bound) noexcept {
  double t = bound;
  for (int k = 0; k < newton_steps; ++k) {
    const double value = ((t * t + quadratic) * t + linear) * t + constant;
    const double slope = (4 * t * t + 2 * quadratic) * t + linear;
    // At a double root both vanish.
    t -= value / (std::abs(slope) + 1e-12);
  }
  return t;
}

}  // namespace

/// The rotation's quaternion is the eigenvector of K to its largest eigenvalue (Davenport's
/// q-method, solved as in QUEST: Shuster and Oh, 1981): the longest column of the adjugate of K - t
/// I.
void fit_rotations(const MatrixBatch& h, Index count, MatrixBatch& rotation,
                   bool determined[MatrixBatch::capacity]) noexcept {
  alignas(64) double certainty[MatrixBatch::capacity];
#pragma omp simd
  for (Index i = 0; i < count; ++i) {
    double squares = 1e-300;
    for (int k = 0; k < 9; ++k) squares += h.entry[k][i] * h.entry[k][i];
    const double scale = 1 / std::sqrt(squares);
    const double a = scale * h.entry[0][i], b = scale * h.entry[1][i], c = scale * h.entry[2][i];
    const double d = scale * h.entry[3][i], e = scale * h.entry[4][i], f = scale * h.entry[5][i];
    const double g = scale * h.entry[6][i], p = scale * h.entry[7][i], q = scale * h.entry[8][i];
    // K, with the scalar part of the quaternion first.
    const double k00 = a + e + q, k11 = a - e - q, k22 = e - a - q, k33 = q - a - e;
    const double k01 = p - f, k02 = c - g, k03 = d - b;
    const double k12 = b + d, k13 = c + g, k23 = f + p;
    const double determinant = a * (e * q - f * p) - b * (d * q - f * g) + c * (d * p - e * g);
    // 2 x 2 minors of the first two and of the last two rows: Laplace's expansion.
    const double m01 = k00 * k11 - k01 * k01, m02 = k00 * k12 - k02 * k01;
    const double m03 = k00 * k13 - k03 * k01, m12 = k01 * k12 - k02 * k11;
    const double m13 = k01 * k13 - k03 * k11, m23 = k02 * k13 - k03 * k12;
    const double n01 = k02 * k13 - k12 * k03, n02 = k02 * k23 - k22 * k03;
    const double n03 = k02 * k33 - k23 * k03, n12 = k12 * k23 - k22 * k13;
    const double n13 = k12 * k33 - k23 * k13, n23 = k22 * k33 - k23 * k23;
    const double constant = m01 * n23 - m02 * n13 + m03 * n12 + m12 * n03 - m13 * n02 + m23 * n01;
    const double t = largest_root(-2, -8 * determinant, constant, 1.7320508075688774);
    const double slope = (4 * t * t - 4) * t - 8 * determinant;
    certainty[i] = squares > least_squares ? slope - least_slope * t * t * t : -1;
    // The columns of the adjugate of L = K - t I.
    const double l0 = k00 - t, l1 = k11 - t, l2 = k22 - t, l3 = k33 - t;
    const double s23 = l2 * l3 - k23 * k23, s13 = k12 * l3 - k23 * k13;
    const double s12 = k12 * k23 - l2 * k13, s03 = k02 * l3 - k23 * k03;
    const double s02 = k02 * k23 - l2 * k03, s01 = k02 * k13 - k12 * k03;
    const double a00 = l1 * s23 - k12 * s13 + k13 * s12;
    const double a01 = -(k01 * s23 - k12 * s03 + k13 * s02);
    const double a02 = k01 * s13 - l1 * s03 + k13 * s01;
    const double a03 = -(k01 * s12 - l1 * s02 + k12 * s01);
    const double r23 = k02 * l3 - k03 * k23, r22 = k02 * k23 - k03 * l2;
    const double a11 = l0 * s23 - k02 * r23 + k03 * r22;
    const double u13 = k01 * l3 - k03 * k13, u12 = k01 * k23 - k03 * k12;
    const double a12 = -(l0 * s13 - k02 * u13 + k03 * u12);
    const double v12 = k01 * l2 - k02 * k12;
    const double v13 = k01 * k23 - k02 * k13;
    const double a13 = l0 * s12 - k02 * v13 + k03 * v12;
    const double w13 = l1 * l3 - k13 * k13, w03 = k01 * l3 - k13 * k03;
    const double w01 = k01 * k13 - l1 * k03;
    const double a22 = l0 * w13 - k01 * w03 + k03 * w01;
    const double x13 = l1 * k23 - k12 * k13, x03 = k01 * k23 - k12 * k03;
    const double x01 = k01 * k13 - l1 * k03;
    const double a23 = -(l0 * x13 - k01 * x03 + k02 * x01);
    const double y12 = l1 * l2 - k12 * k12, y02 = k01 * l2 - k12 * k02;
    const double y01 = k01 * k12 - l1 * k02;
    const double a33 = l0 * y12 - k01 * y02 + k02 * y01;
    // The adjugate is c v v^T, v the eigenvector: the longest column has the largest diagonal.
    const double c0 = a00 * a00, c1 = a11 * a11, c2 = a22 * a22, c3 = a33 * a33;
    const bool second = c1 > c0, fourth = c3 > c2;
    const double front = second ? c1 : c0, back = fourth ? c3 : c2;
    const bool behind = back > front;
    const double front_w = second ? a01 : a00, back_w = fourth ? a03 : a02;
    const double front_x = second ? a11 : a01, back_x = fourth ? a13 : a12;
    const double front_y = second ? a12 : a02, back_y = fourth ? a23 : a22;
    const double front_z = second ? a13 : a03, back_z = fourth ? a33 : a23;
    const double w = behind ? back_w : front_w, x = behind ? back_x : front_x;
    const double y = behind ? back_y : front_y, z = behind ? back_z : front_z;
    const double two = 2 / (w * w + x * x + y * y + z * z + 1e-300);
    rotation.entry[0][i] = 1 - two * (y * y + z * z);
    rotation.entry[1][i] = two * (x * y - w * z);
    rotation.entry[2][i] = two * (x * z + w * y);
    rotation.entry[3][i] = two * (x * y + w * z);
    rotation.entry[4][i] = 1 - two * (x * x + z * z);
    rotation.entry[5][i] = two * (y * z - w * x);
    rotation.entry[6][i] = two * (x * z - w * y);
    rotation.entry[7][i] = two * (y * z + w * x);
    rotation.entry[8][i] = 1 - two * (x * x + y * y);
  }
  for (Index i = 0; i < count; ++i) determined[i] = certainty[i] > 0;
}

}  // namespace vnreg::kernels
