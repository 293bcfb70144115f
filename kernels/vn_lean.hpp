// The lean block of the network `vnreg` (docs/design.md): n = v by its r.m.s. length, h =
// VN-ReLU(n), v + W h + Q mean h. Vector features of a tile as in vn_linear.hpp; padding rows stay
// zero.
#pragma once

#include "kernels/vn_linear.hpp"

namespace vnreg::kernels {

inline constexpr float rms_epsilon = 1e-2f;

struct LeanBlock {
  PackedMatrix direction, linear;
  PackedMatrix pool;  // empty where the block is not pooled

  Index rows() const noexcept { return linear.padded_rows(); }
};

/// n = v / sqrt(mean over `channels` of |v_c|^2 + rms_epsilon), per point. `n` may be `v`.
void normalize_vectors(const float* v, Index rows, Index channels, Index points, float* n) noexcept;

/// h = VN-ReLU(n(v)), then v += W h. `normalized` and `h` are tiles as large as `v`.
void lean_block(const LeanBlock& block, Index points, float* v, float* normalized,
                float* h) noexcept;

/// v += m for every point, m of rows x 3.
void add_to_points(const float* m, Index rows, Index points, float* v) noexcept;

/// Inner products <v_c, q_p> with `count` partners q (a tile of `partner_rows` rows, or one rows x
/// 3 feature that all points share): out[p * rows + c] of each point, whose columns are
/// `out_stride` apart.
void partner_products(const float* v, Index rows, const float* partners, Index partner_rows,
                      bool shared, Index count, Index points, float* out,
                      Index out_stride) noexcept;

}  // namespace vnreg::kernels
