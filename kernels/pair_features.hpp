// Pair features and similarities of the fine register (paper, section III-D, after IDAM): for kept
// points i (source, moved) and j (target),
//   f = W1 relu(W0 [F_i; F_j; e; (x_i - y_j) / (e + 1e-8)] + b0) + b1,  e = |x_i - y_j|,
//   s = clamp(W3 relu(W2 f + b2) + b3, +-20).
// W0 splits into a source, a target and a distance part; the first two do not change between
// iterations and are computed once. W2 f + b2 = (W2 W1) r + (W2 b1 + b2) with r = relu(...), so one
// product of stacked weights gives f and the hidden layer of s.
#pragma once

#include <span>

#include "kernels/linear.hpp"
#include "kernels/spatial_index.hpp"

namespace vnreg::kernels {

inline constexpr float similarity_limit = 20.0f;

/// Row-major (out, in) tensors, D descriptor channels and P pair channels.
struct PairTensors {
  Index descriptor = 0;
  Index pair = 0;
  std::span<const float> weight0, bias0;                        // (P, 2D + 4), (P)
  std::span<const float> weight1, bias1;                        // (P, P), (P)
  std::span<const float> similarity_weight0, similarity_bias0;  // (P, P), (P)
  std::span<const float> similarity_weight1, similarity_bias1;  // (1, P), (1)
};

struct PairLayer {
  Index rows = 0;       // padded P
  Linear source;        // with b0
  Linear target;        // no bias
  Floats distance;      // column of e
  Floats direction[3];  // columns of the unit difference
  Linear stacked;       // rows [0, P): f; rows [padded P, ..): the hidden layer of s
  Floats similarity;    // W3
  float similarity_bias = 0;
};

PairLayer make_pair_layer(const PairTensors& tensors);

/// Working memory of one thread.
struct PairScratch {
  Floats first, second;  // a chunk of pairs
  Floats distance, dx, dy, dz;

  PairScratch() = default;
  explicit PairScratch(const PairLayer& layer);
};

/// One source point against all `count` target points. `source_part` (rows) and `target_parts`
/// (rows x count) are what layer.source and layer.target make of the descriptors. Writes `count`
/// similarities and the maximum over j of f (rows).
void pair_row(const PairLayer& layer, const float* source_part, const float* target_parts,
              const float position[3], const Coordinates& targets, Index count,
              PairScratch& scratch, float* similarities, float* row_maximum) noexcept;

}  // namespace vnreg::kernels
