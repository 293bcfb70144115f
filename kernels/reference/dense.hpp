// Layers on plain features, written plainly, in float64: one row per point. For tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "kernels/pair_features.hpp"
#include "kernels/reference/vn.hpp"

namespace vnreg::kernels::reference {

using Row = std::vector<double>;
using Rows = std::vector<Row>;

inline Row linear(std::span<const float> w, std::span<const float> b, const Row& x) {
  Row y(b.begin(), b.end());
  for (std::size_t o = 0; o < y.size(); ++o) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      y[o] += static_cast<double>(w[o * x.size() + i]) * x[i];
    }
  }
  return y;
}

inline Row relu(Row x) {
  for (double& v : x) v = std::max(v, 0.0);
  return x;
}

/// V Z^T of every point, flattened as channel * 3 + frame vector. `z` has three channels.
inline Rows invariant_products(const Vectors& v, const Vectors& z) {
  Rows rows(static_cast<std::size_t>(v.points), Row(static_cast<std::size_t>(3 * v.channels)));
  for (Index p = 0; p < v.points; ++p) {
    for (Index c = 0; c < v.channels; ++c) {
      for (Index f = 0; f < 3; ++f) {
        double& out = rows[static_cast<std::size_t>(p)][static_cast<std::size_t>(3 * c + f)];
        for (Index axis = 0; axis < 3; ++axis) out += v.at(p, c, axis) * z.at(p, f, axis);
      }
    }
  }
  return rows;
}

/// W1 relu(W0 [F_i; F_j; e; unit difference] + b0) + b1 of one pair.
inline Row pair_feature(const PairTensors& t, const Row& source, const Row& target,
                        std::span<const double> x, std::span<const double> y) {
  Row input = source;
  input.insert(input.end(), target.begin(), target.end());
  const double e = std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
  input.push_back(e);
  for (std::size_t axis = 0; axis < 3; ++axis) input.push_back((x[axis] - y[axis]) / (e + 1e-8));
  return linear(t.weight1, t.bias1, relu(linear(t.weight0, t.bias0, input)));
}

/// clamp(MLP(pair feature), +-20).
inline double similarity(const PairTensors& t, const Row& pair_feature) {
  const Row hidden = relu(linear(t.similarity_weight0, t.similarity_bias0, pair_feature));
  return std::clamp(linear(t.similarity_weight1, t.similarity_bias1, hidden)[0], -20.0, 20.0);
}

}  // namespace vnreg::kernels::reference
