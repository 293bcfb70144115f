// Working memory of the encoder of architecture `vnreg`, sized once.
#pragma once

#include "engine/descriptors.hpp"
#include "engine/parallel.hpp"
#include "kernels/collect.hpp"

namespace vnreg::detail {

/// Encoded points per tile (see kernels/vn_linear.hpp).
inline constexpr Index encoded_tile = 32;

constexpr Index encoded_tiles(Index points) noexcept {
  return (points + encoded_tile - 1) / encoded_tile;
}

/// Activations of one cloud. Vector features lie tile after tile, scalars point after point.
struct DescriptorFeatures {
  CloudDescriptors out;
  std::vector<std::uint64_t> keys;    // of the selection
  kernels::Floats local_inputs;       // 21 vectors; kept only when stages are recorded
  kernels::Floats scalar_inputs;      // 18; kept only when stages are recorded
  kernels::Floats context_inputs;     // 8 vectors
  kernels::Floats v;                  // C
  kernels::Floats kept_v;             // C: v at the end of the local stage, when recorded
  kernels::Floats normalized;         // C: n(v) at the end
  kernels::Floats z;                  // H: z1, then z2, then z3
  kernels::Floats near;               // H: mean scalars of the second neighbourhood
  kernels::Floats messages[2];        // of the two neighbourhood layers
  kernels::Floats sums, scalar_sums;  // per tile
  kernels::Floats mean, scalar_mean, constant, mlp_constant, partners;
  kernels::Floats share;  // logits, then weights, of the global feature
};

/// What one thread needs while it works on one tile.
struct DescriptorScratch {
  kernels::Floats leaf_bounds;
  kernels::CollectScratch collect;
  kernels::Floats local_inputs, scalar_inputs, gate, normalized, h;
  kernels::Floats message;    // of each point's neighbourhood, summed
  kernels::Floats collected;  // K + C
  kernels::Floats near, partners, mlp_input, hidden, frames, logits;
};

struct DescriptorWorkspace {
  DescriptorWorkspace() = default;
  DescriptorWorkspace(const DescriptorModel& model, Index max_points, int threads, bool record);

  DescriptorFeatures features[2];
  std::vector<DescriptorScratch> scratch;
};

}  // namespace vnreg::detail
