// Poses proposed by the surfaces alone: a pair of source points with normals matched to a pair of
// target points at the same distance and the same angles fixes a rigid motion (the idea of point
// pair features; the normals need no consistent sign here).
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Draws source pairs by `seed`, looks up their counterparts among the pairs of the target, tries
/// the motions that these give, and leaves the best of each chunk of draws in verified.hypotheses
/// and their numbers in verified.kept.
void propose_poses(std::uint64_t seed, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
