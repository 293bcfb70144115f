#include "kernels/linear.hpp"

#include <algorithm>

namespace vnreg::kernels {

Linear::Linear(const RowMajorMatrix& w, std::span<const float> b)
    : weights(w), bias(static_cast<std::size_t>(padded(w.rows())), 0.0f) {
  std::copy(b.begin(), b.end(), bias.begin());
}

void linear(const Linear& layer, const float* x, Index x_stride, Index columns, float* y) noexcept {
  multiply_bias(layer.weights, x, x_stride, columns, y, layer.padded_rows(), layer.bias.data(), 0,
                columns);
}

void relu(float* x, Index count) noexcept {
#pragma omp simd
  for (Index i = 0; i < count; ++i) x[i] = x[i] > 0.0f ? x[i] : 0.0f;
}

}  // namespace vnreg::kernels
