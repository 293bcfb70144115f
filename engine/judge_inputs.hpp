// What the judge is told of the points of both clouds (docs/design.md, "The judge").
#pragma once

#include "engine/motion.hpp"
#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Chooses the points of both clouds, most_judged_points of each or fewer.
void choose_judged_points(Workspace& workspace) noexcept;

/// Finds what of the chosen points first .. last - 1 of each cloud does not depend on the pose.
void describe_judged_points(Index first, Index last, Workspace& workspace) noexcept;

/// Writes the inputs of one pose (in units of the surfaces): a column of judge_point_inputs
/// numbers, padded, for each of the first `most` described points of the source, then of the
/// target. Returns the number of columns.
Index write_judge_inputs(const Motion& motion, Index most, const Workspace& workspace,
                         JudgeScratch& scratch) noexcept;

}  // namespace vnreg::detail
