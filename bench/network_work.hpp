// Floating-point operations of the encoders, counted from the widths alone: every product of the
// exact algebra of docs/design.md (two operations per multiply-add), nothing element-wise. The
// paper's network (C = 128, both clouds of 1,024 points) comes to 7.4 GFLOP so, of 12.2 as it is
// usually written.
#pragma once

#include "engine/architecture.hpp"
#include "engine/descriptor_model.hpp"

namespace vnreg::bench {

/// Networks 0 to 2, invariant layer, descriptors and significances; per point.
double paper_flops_per_point(const detail::Architecture& arch);

/// What the neighbourhoods of one cloud hold.
struct NeighbourhoodPairs {
  double moments;  // (encoded point, any point) nearer than a radius, summed over the three radii
  double local, context;  // (encoded, encoded) nearer than the radius of the layer
};

/// The whole network `vnreg` on one cloud: products, 40 operations per pair of the moments (the
/// weighted powers of an offset), two per pair and number of a message.
double vnreg_flops(const detail::DescriptorArchitecture& arch, double encoded,
                   const NeighbourhoodPairs& pairs);

}  // namespace vnreg::bench
