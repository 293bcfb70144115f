// Poses proposed by matches of descriptors: each match by itself, through the frames of its two
// points, and groups of matches that agree with each other.
#pragma once

#include "engine/motion.hpp"
#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Fills verified.match.motions with hypotheses from the descriptors of both clouds; the workspace
/// has them. Returns their number, at most most_match_hypotheses.
Index propose_from_matches(Workspace& workspace) noexcept;

}  // namespace vnreg::detail
