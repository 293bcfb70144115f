// Point-to-plane steps from a pose that is nearly right.
#pragma once

#include "engine/surface.hpp"
#include "engine/verify.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

struct RefineStage {
  Index points;     // the first points of the source that take part
  float tolerance;  // a match farther away than this counts less than a quarter
  int most_steps;
  Search search;
};

/// Gauss-Newton steps on the source's matches, reweighted at each step by distance and by agreement
/// of the normals (IRLS with Geman-McClure weights), until a step is too small to matter.
kernels::RigidTransform refine(const kernels::RigidTransform& pose, const Surface surface[2],
                               const RefineStage& stage) noexcept;

}  // namespace vnreg::detail
