// The global register (paper, section III-C).
#pragma once

#include "engine/workspace.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

struct CoarsePose {
  kernels::RigidTransform transform;  // target_network = R source_network + t
  bool determined = false;            // false: the features do not determine a rotation
};

/// Procrustes on the C paired vectors of both global features.
CoarsePose register_coarse(const ModelData& model, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
