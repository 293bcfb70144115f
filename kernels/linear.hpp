// Layers on plain (invariant) features: linear with bias, ReLU, sigmoid. Features of n points are a
// column-major matrix, one point per column. Batch norms are folded into weights and bias.
#pragma once

#include <cmath>
#include <span>

#include "kernels/vn_linear.hpp"

namespace vnreg::kernels {

struct Linear {
  PackedMatrix weights;
  Floats bias;  // padded rows

  Linear() = default;
  Linear(const RowMajorMatrix& w, std::span<const float> b);

  Index padded_rows() const noexcept { return weights.padded_rows(); }
};

/// y = W x + b for `columns` columns; `y` has layer.padded_rows() rows.
void linear(const Linear& layer, const float* x, Index x_stride, Index columns, float* y) noexcept;

/// x = max(x, 0).
void relu(float* x, Index count) noexcept;

inline float sigmoid(float x) noexcept { return 1.0f / (1.0f + std::exp(-x)); }

}  // namespace vnreg::kernels
