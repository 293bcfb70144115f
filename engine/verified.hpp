// Mode `verified`: many poses are proposed, each is judged by both surfaces, the best are refined
// and compared again. Not part of the paper.
#pragma once

#include <span>

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// What is left of all hypotheses: distinct poses, the best first.
struct VerifiedPoses {
  static constexpr Index capacity = 5;
  Index count = 0;
  ScoredPose pose[capacity];  // network coordinates
  bool judged = false;        // scores are the judge's log-odds, else those of fits
};

/// `proposals` (at most most_proposals): poses of other registers, refined and compared like the
/// best hypotheses. Sets ms.hypotheses and ms.verify of the times. No pose: the clouds determine no
/// rotation, or the deadline passed before the hypotheses were compared; when it passes later, the
/// best poses until then.
VerifiedPoses register_verified(std::span<const kernels::RigidTransform> proposals,
                                std::uint64_t seed, Workspace& workspace,
                                StageTimes& times) noexcept;

/// Whether the second pose explains the clouds so nearly as well as the first that which is right
/// cannot be told.
bool ambiguous(const VerifiedPoses& poses) noexcept;

}  // namespace vnreg::detail
