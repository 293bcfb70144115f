#include "kernels/vn_lean.hpp"

#include <cmath>

#include "kernels/vn_relu.hpp"

namespace vnreg::kernels {

void normalize_vectors(const float* v, Index rows, Index channels, Index points,
                       float* n) noexcept {
  const VectorsView in = tile_view(v, rows, points);
  const MutableVectorsView out = tile_view(n, rows, points);
  const float share = 1.0f / static_cast<float>(channels);
  for (Index p = 0; p < points; ++p) {
    float squared = 0;
    for (Index axis = 0; axis < 3; ++axis) {
      squared += Eigen::Map<const Eigen::ArrayXf>(in.at(p, axis), rows).square().sum();
    }
    const float factor = 1.0f / std::sqrt(share * squared + rms_epsilon);
    for (Index axis = 0; axis < 3; ++axis) {
      Eigen::Map<Eigen::ArrayXf>(out.at(p, axis), rows) =
          factor * Eigen::Map<const Eigen::ArrayXf>(in.at(p, axis), rows);
    }
  }
}

void lean_block(const LeanBlock& block, Index points, float* v, float* normalized,
                float* h) noexcept {
  const Index rows = block.rows();
  normalize_vectors(v, rows, block.linear.rows(), points, normalized);
  multiply(block.direction, normalized, rows, 3 * points, h, rows);
  vn_relu(points, rows, tile_view<const float>(normalized, rows, points),
          tile_view(h, rows, points));
  multiply_add(block.linear, h, rows, 3 * points, v, rows);
}

void add_to_points(const float* m, Index rows, Index points, float* v) noexcept {
  for (Index axis = 0; axis < 3; ++axis) {
    const Eigen::Map<const Eigen::ArrayXf> constant(m + axis * rows, rows);
    for (Index p = 0; p < points; ++p) {
      Eigen::Map<Eigen::ArrayXf>(v + (axis * points + p) * rows, rows) += constant;
    }
  }
}

void partner_products(const float* v, Index rows, const float* partners, Index partner_rows,
                      bool shared, Index count, Index points, float* out,
                      Index out_stride) noexcept {
  const VectorsView vectors = tile_view(v, rows, points);
  const VectorsView q =
      shared ? VectorsView{partners, 0, partner_rows} : tile_view(partners, partner_rows, points);
  for (Index p = 0; p < points; ++p) {
    const float* vx = vectors.at(p, 0);
    const float* vy = vectors.at(p, 1);
    const float* vz = vectors.at(p, 2);
    float* products = out + p * out_stride;
    for (Index k = 0; k < count; ++k, products += rows) {
      const float qx = q.at(p, 0)[k], qy = q.at(p, 1)[k], qz = q.at(p, 2)[k];
#pragma omp simd
      for (Index c = 0; c < rows; ++c) products[c] = vx[c] * qx + vy[c] * qy + vz[c] * qz;
    }
  }
}

}  // namespace vnreg::kernels
