// The weights of architecture `vnreg`, checked against docs/design.md and packed once.
#pragma once

#include <vector>

#include "engine/tensor_set.hpp"
#include "kernels/linear.hpp"
#include "kernels/moments.hpp"
#include "kernels/vn_lean.hpp"

namespace vnreg::detail {

struct DescriptorArchitecture {
  Index vectors = 0;   // C
  Index scalars = 0;   // H
  Index gates = 0;     // K
  Index products = 0;  // P
  Index local_descriptor = 0;
  Index context_descriptor = 0;
  Index frames = 0;  // F
  Index global = 0;  // G
  Index local_blocks = 0;
  Index context_blocks = 0;
  Index encoded = 0;  // points of a cloud that are described, at most
  float moment_radii[kernels::moment_radii] = {0, 0, 0};
  float local_radius = 0;
  float context_radius = 0;
};

/// A neighbourhood layer. A row of a point's message is x gates | y gates | z gates | gates |
/// x vectors | y vectors | z vectors | scalars, each part padded.
struct CollectLayer {
  float radius = 0;
  kernels::Linear gate;
  kernels::PackedMatrix collect;  // columns: gated offsets, padded; vectors, padded

  Index gate_rows() const noexcept { return gate.padded_rows(); }
  Index message_length() const noexcept {
    return 4 * gate_rows() + 3 * collect.padded_rows() + kernels::padded(gate.weights.cols());
  }
};

/// Descriptor and frames of the points at the end of a stage.
struct PointHead {
  kernels::Linear descriptor;
  float length = 0;
  kernels::PackedMatrix frames;
};

struct DescriptorModel {
  DescriptorArchitecture arch;

  kernels::Linear input_scalars;
  kernels::PackedMatrix local_vectors;
  kernels::Linear input_gate;
  kernels::LeanBlock point_block;
  kernels::PackedMatrix point_products;
  kernels::Linear point_mlp;

  CollectLayer local_collect;
  std::vector<kernels::LeanBlock> local_blocks;
  kernels::PackedMatrix local_products;
  kernels::Linear local_mlp[2];
  PointHead local_head;

  kernels::PackedMatrix context_vectors;
  CollectLayer context_collect;
  std::vector<kernels::LeanBlock> context_blocks;
  kernels::PackedMatrix context_products, context_products_pooled;
  kernels::Linear context_mlp[2];
  kernels::PackedMatrix
      context_mlp_pooled;  // the part of context_mlp[0] that takes the mean scalars
  PointHead context_head;
  kernels::Linear logits;
  kernels::PackedMatrix global;
};

/// Throws Error: wrong_architecture, missing_tensor.
DescriptorModel read_descriptor_model(const model_format::ModelFile& file, TensorSet& tensors);

}  // namespace vnreg::detail
