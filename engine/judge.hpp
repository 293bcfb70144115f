// Which of the poses that are left is right (docs/design.md, "The judge"): a small network that
// sees points of both clouds, as a pose lays them onto the other cloud, and what that cloud shows
// there.
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Finds what does not depend on the poses, from the pair's surfaces, descriptors and matches.
/// First, once a pair.
void begin_judging(Workspace& workspace) noexcept;

/// Replaces the scores of `count` (at most final_poses) poses, in units of the surfaces, by the
/// log-odds that they are right. Without a judge it does nothing, and returns false.
bool judge_poses(ScoredPose* poses, Index count, Workspace& workspace) noexcept;

/// Where stages are recorded: what the judge is trained on, of poses with the scores of their fits.
void record_judgement(const ScoredPose* fits, Index count, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
