// What architecture `vnreg` says of a cloud: the material of pose hypotheses (docs/design.md).
#pragma once

#include <cstdint>
#include <vector>

#include "engine/descriptor_model.hpp"

namespace vnreg::detail {

/// All positions and vectors are in network coordinates, about the cloud's centroid. Row i of every
/// array belongs to the i-th encoded point; rows are padded with zeros to whole SIMD packets where
/// a stride is given.
struct CloudDescriptors {
  Index count = 0;                     // E encoded points
  std::vector<std::uint32_t> encoded;  // their indices in the cloud; near ones close together
  kernels::Floats x, y, z;             // their places

  // The similarity of two points is <local, local'> + <context, context'>: a logit.
  Index local_stride = 0, context_stride = 0;
  kernels::Floats local;    // E x local_stride; unchanged by what lies beyond the neighbourhood
  kernels::Floats context;  // E x context_stride
  kernels::Floats significance;  // E logits of "my best match is right"
  kernels::Floats overlap;       // E logits of "the other cloud has this place"

  // Vectors that turn with the cloud, of unit Frobenius norm per point: R of a match maximises
  // sum_f <R source_f, target_f>.
  Index frames = 0;                // F
  kernels::Floats local_frames;    // E x F x 3
  kernels::Floats context_frames;  // E x F x 3

  kernels::Floats covariance;  // E x 6: xx, xy, xz, yy, yz, zz of the points near, of the smallest
                               // moment radius r, times 4 / r^2
  Index global_rows = 0;       // column stride of `global`
  kernels::Floats global;  // G points as x | y | z; paired rows of two clouds give a coarse pose

  CloudDescriptors() = default;
  CloudDescriptors(const DescriptorArchitecture& arch, Index max_encoded);
};

}  // namespace vnreg::detail
