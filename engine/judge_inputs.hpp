// What the judge is told of the points of both clouds (docs/design.md, "The judge").
#pragma once

#include "engine/motion.hpp"
#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Chooses the points of both clouds, and finds what does not depend on the pose.
void choose_judged_points(Workspace& workspace) noexcept;

/// Writes the inputs of one pose (in units of the surfaces): a column of judge_point_inputs
/// numbers, padded, per judged point, those of the source first. Returns the number of columns.
Index write_judge_inputs(const Motion& motion, const Workspace& workspace,
                         JudgeScratch& scratch) noexcept;

}  // namespace vnreg::detail
