// The object of the examples: points on a mug, and scans of it in arbitrary poses. Metres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <vnreg/vnreg.hpp>

using Points = std::vector<std::array<float, 3>>;

/// Points on wall, bottom and handle, in the mug's own frame.
inline Points mug(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> share(0, 1);
  constexpr float pi = 3.14159265f;
  Points points(count);
  for (auto& p : points) {
    const float part = share(random), turn = 2 * pi * share(random), other = share(random);
    if (part < 0.68f) {
      p = {0.04f * std::cos(turn), 0.04f * std::sin(turn), 0.1f * other};
    } else if (part < 0.82f) {
      const float radius = 0.04f * std::sqrt(other);
      p = {radius * std::cos(turn), radius * std::sin(turn), 0};
    } else {
      const float bend = pi * (other - 0.5f), ring = 0.03f + 0.006f * std::cos(turn);
      p = {0.038f + ring * std::cos(bend), 0.006f * std::sin(turn), 0.05f + ring * std::sin(bend)};
    }
  }
  return points;
}

struct Scan {
  Points points;
  vnreg::Pose T_mug_scan;  // the answer that a registration should find
};

/// Points of their own on the mug with 0.3 mm of noise, turned and moved at random.
inline Scan scan_mug(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed ^ 0x5ca9);
  std::normal_distribution<double> normal;
  double q[4] = {normal(random), normal(random), normal(random), normal(random)};
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& v : q) v /= length;
  const auto [w, x, y, z] = q;
  const double R[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  const double t[3] = {normal(random), normal(random), normal(random)};
  Scan scan;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) scan.T_mug_scan[4 * i + j] = R[i][j];
    scan.T_mug_scan[4 * i + 3] = t[i];
  }
  scan.T_mug_scan[15] = 1;
  // point = R^T (mug point - t)
  for (const auto& p : mug(count, seed)) {
    std::array<double, 3> moved;
    for (std::size_t i = 0; i < 3; ++i) moved[i] = static_cast<double>(p[i]) - t[i];
    auto& out = scan.points.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const double v = R[0][i] * moved[0] + R[1][i] * moved[1] + R[2][i] * moved[2];
      out[i] = static_cast<float>(v + 0.0003 * normal(random));
    }
  }
  return scan;
}

/// Degrees between the rotations of two poses.
inline double rotation_error_deg(const vnreg::Pose& a, const vnreg::Pose& b) {
  double squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double d = a[4 * i + j] - b[4 * i + j];
      squares += d * d;
    }
  }
  return 2 * std::asin(std::min(1.0, std::sqrt(squares / 8))) * 180 / 3.14159265358979;
}
