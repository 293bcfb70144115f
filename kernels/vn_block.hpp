// The VN ResNet block (paper, section III-A): out = S V + F1 relu1(F0 relu0(V)).
//
// In the encoder the input of a block is [v; m]: the C channels of each point beside C channels
// that are equal for all points of the cloud (their mean, or the global feature). A product with
// the concatenation splits exactly, W [v; m] = W1 v + W2 m, and W2 m is computed once per cloud.
#pragma once

#include <span>

#include "kernels/vn_linear.hpp"

namespace vnreg::kernels {

/// A block i -> o as stored: row-major (out, in) matrices with h = min(i, o) hidden channels.
struct VnBlockTensors {
  Index in = 0;
  Index out = 0;
  bool shared_direction = false;    // relu0 and relu1 have one row
  std::span<const float> relu0;     // (i or 1, i)
  std::span<const float> fc0;       // (h, i)
  std::span<const float> relu1;     // (h or 1, h)
  std::span<const float> fc1;       // (o, h)
  std::span<const float> shortcut;  // (o, i); empty: the identity, i = o

  Index hidden() const noexcept { return in < out ? in : out; }
};

/// What follows the first VN-ReLU: h = F0 relu0(V), relu1(h), F1.
struct VnBlockTail {
  bool shared_direction = false;
  PackedMatrix fc0;  // columns: two halves, each padded
  PackedMatrix direction1;
  PackedMatrix fc1;

  Index hidden_rows() const noexcept { return fc0.padded_rows(); }
};

/// A block whose input is [v; m], C + C channels.
struct VnBlock {
  Index half = 0;  // padded rows of v and of m
  PackedMatrix direction0_v, direction0_m;
  PackedMatrix shortcut_v, shortcut_m;
  VnBlockTail tail;

  Index out_rows() const noexcept { return shortcut_v.padded_rows(); }
};

/// The first block behind the linear layer `pre` (i x 3) that lifts the three edge vectors:
/// V = P e has rank 3, so U V = (U P) e and S V = (S P) e are products with three columns.
struct EdgeBlock {
  Index half = 0;           // half of the padded rows of V
  PackedMatrix input;       // P
  PackedMatrix direction0;  // U P
  PackedMatrix shortcut;    // S P
  VnBlockTail tail;

  Index out_rows() const noexcept { return shortcut.padded_rows(); }
};

VnBlock make_vn_block(const VnBlockTensors& tensors);
EdgeBlock make_edge_block(std::span<const float> pre, const VnBlockTensors& tensors);

/// What m contributes to every point of a cloud; each matrix is padded rows x 3.
struct VnBlockConstants {
  Floats m, direction0, shortcut;

  /// Grows to what the block needs.
  void reserve(const VnBlock& block);
};

void set_constants(const VnBlock& block, const float* m, VnBlockConstants& constants) noexcept;

/// Working memory of one thread, for tiles of up to `points` points.
struct VnScratch {
  Floats lifted;            // V of the first block, 2 * half rows
  Floats activated;         // relu0(V), 2 * half rows
  Floats hidden;            // F0 relu0(V)
  Floats activated_hidden;  // relu1(hidden)
  Floats direction;         // the one direction per point of shared VN-ReLUs

  /// Grows to what the block needs.
  void reserve(Index half, const VnBlockTail& tail, Index points);
};

/// relu1(F0 relu0([v; m])) into scratch.activated_hidden (hidden_rows x 3 points).
void vn_block_hidden(const VnBlock& block, const VnBlockConstants& constants, const float* v,
                     Index points, VnScratch& scratch) noexcept;

/// The whole block; `v` has block.half rows, `out` block.out_rows().
void vn_block(const VnBlock& block, const VnBlockConstants& constants, const float* v, Index points,
              VnScratch& scratch, float* out) noexcept;

/// The first block; `edges` has exactly three rows.
void edge_block(const EdgeBlock& block, const float* edges, Index points, VnScratch& scratch,
                float* out) noexcept;

}  // namespace vnreg::kernels
