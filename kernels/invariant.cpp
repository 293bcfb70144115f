#include "kernels/invariant.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/vn_relu.hpp"

namespace vnreg::kernels {
namespace {

/// q = (p / n)(scale n + shift), n = |p| + 1e-7, in place.
void normalize_lengths(const VnNormLayer& layer, Index points, MutableVectorsView p) noexcept {
  const float* scale = layer.scale.data();
  const float* shift = layer.shift.data();
  for (Index i = 0; i < points; ++i) {
    float* x = p.at(i, 0);
    float* y = p.at(i, 1);
    float* z = p.at(i, 2);
#pragma omp simd
    for (Index c = 0; c < layer.out_rows(); ++c) {
      const float n = std::sqrt(x[c] * x[c] + y[c] * y[c] + z[c] * z[c]) + vn_epsilon;
      const float factor = (scale[c] * n + shift[c]) / n;
      x[c] *= factor;
      y[c] *= factor;
      z[c] *= factor;
    }
  }
}

Floats padded_copy(std::span<const float> values) {
  Floats out(static_cast<std::size_t>(padded(static_cast<Index>(values.size()))), 0.0f);
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

}  // namespace

VnNormLayer make_vn_norm_layer(const RowMajorMatrix& fc, const RowMajorMatrix& direction,
                               std::span<const float> scale, std::span<const float> shift,
                               bool shared_direction) {
  return {shared_direction, PackedMatrix(fc), PackedMatrix(direction), padded_copy(scale),
          padded_copy(shift)};
}

void vn_norm_layer(const VnNormLayer& layer, const float* v, Index v_stride, Index points,
                   float* projected, float* direction, float* out) noexcept {
  const Index rows = layer.out_rows();
  multiply(layer.fc, v, v_stride, 3 * points, projected, rows);
  normalize_lengths(layer, points, tile_view(projected, rows, points));
  const VectorsView q = tile_view<const float>(projected, rows, points);
  if (layer.shared_direction) {
    multiply(layer.direction, v, v_stride, 3 * points, direction, packet_size);
    vn_relu_shared(points, rows, q, tile_view<const float>(direction, packet_size, points),
                   tile_view(out, rows, points));
  } else {
    multiply(layer.direction, v, v_stride, 3 * points, out, rows);
    vn_relu(points, rows, q, tile_view(out, rows, points));
  }
}

void invariant_products(const float* v, Index v_rows, const float* frame, Index z_rows,
                        Index points, float* products) noexcept {
  const VectorsView vectors = tile_view(v, v_rows, points);
  const VectorsView frames = tile_view(frame, z_rows, points);
  for (Index p = 0; p < points; ++p) {
    const float* x = vectors.at(p, 0);
    const float* y = vectors.at(p, 1);
    const float* z = vectors.at(p, 2);
    for (Index f = 0; f < 3; ++f, products += v_rows) {
      const float zx = frames.at(p, 0)[f];
      const float zy = frames.at(p, 1)[f];
      const float zz = frames.at(p, 2)[f];
#pragma omp simd
      for (Index c = 0; c < v_rows; ++c) products[c] = x[c] * zx + y[c] * zy + z[c] * zz;
    }
  }
}

Linear make_descriptor_layer(const RowMajorMatrix& weights, std::span<const float> bias,
                             Index channels) {
  RowMajorMatrix reordered = RowMajorMatrix::Zero(weights.rows(), 3 * padded(channels));
  for (Index c = 0; c < channels; ++c) {
    for (Index f = 0; f < 3; ++f) {
      reordered.col(f * padded(channels) + c) = weights.col(3 * c + f);
    }
  }
  return {reordered, bias};
}

}  // namespace vnreg::kernels
