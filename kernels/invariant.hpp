// The invariant layer (paper, section III-B): a frame Z of three vectors per point turns with the
// cloud as the features V do, so V Z^T does not turn: (V R)(Z R)^T = V Z^T.
#pragma once

#include <span>

#include "kernels/linear.hpp"
#include "kernels/vn_linear.hpp"

namespace vnreg::kernels {

/// VN-linear, VN batch norm (folded to scale and shift of the length), VN-ReLU.
struct VnNormLayer {
  bool shared_direction = false;
  PackedMatrix fc;
  PackedMatrix direction;  // the direction comes from the layer's input
  Floats scale, shift;     // padded rows

  Index out_rows() const noexcept { return fc.padded_rows(); }
};

/// `fc` is (out, in), `direction` (out or 1, in).
VnNormLayer make_vn_norm_layer(const RowMajorMatrix& fc, const RowMajorMatrix& direction,
                               std::span<const float> scale, std::span<const float> shift,
                               bool shared_direction);

/// `v` has the layer's input rows (stride v_stride), `out` and `projected` (working memory)
/// layer.out_rows(); `direction` (working memory) packet_size rows; all 3 * points columns.
void vn_norm_layer(const VnNormLayer& layer, const float* v, Index v_stride, Index points,
                   float* projected, float* direction, float* out) noexcept;

/// The L x 3 products V Z^T of each point, one column of 3 * v_rows numbers per point: row
/// f * v_rows + c is <V_c, Z_f>. `frame` has z_rows rows, of which the first three count.
void invariant_products(const float* v, Index v_rows, const float* frame, Index z_rows,
                        Index points, float* products) noexcept;

/// The linear layer (out, 3L) that reads V Z^T flattened as c * 3 + f, its columns reordered to the
/// rows of invariant_products().
Linear make_descriptor_layer(const RowMajorMatrix& weights, std::span<const float> bias,
                             Index channels);

}  // namespace vnreg::kernels
