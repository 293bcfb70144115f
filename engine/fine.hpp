// The local register (paper, section III-D, after IDAM).
#pragma once

#include "engine/workspace.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

/// Hard elimination to the most significant points, then `fine.iterations` rounds of matching and
/// weighted Procrustes, starting from and including the coarse pose. Network coordinates.
kernels::RigidTransform register_fine(const ModelData& model, const kernels::RigidTransform& coarse,
                                      Workspace& workspace) noexcept;

}  // namespace vnreg::detail
