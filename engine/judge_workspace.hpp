// Working memory of the judge, sized once.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/judge_model.hpp"
#include "engine/surface.hpp"
#include "engine/verify.hpp"
#include "kernels/surroundings.hpp"

namespace vnreg::detail {

/// Points of each cloud that the judge looks at: of every pose, and of those between which it
/// is hard to choose.
inline constexpr Index judged_points = 64;
inline constexpr Index most_judged_points = 256;

/// The judged points of one cloud, and what is known of them whatever the pose.
struct JudgedCloud {
  Surface points;                                  // places and normals only
  std::uint16_t encoded[most_judged_points] = {};  // which descriptor is theirs
  kernels::Surroundings own[most_judged_points][kernels::surroundings_radii];
  kernels::SpatialIndex described;             // of the encoded points
  std::vector<std::uint16_t> nearest_encoded;  // of every point of the cloud's surface
  kernels::Floats log_sum;  // per encoded point: log of the sum of exp(similarity) over the others

  JudgedCloud() = default;
  JudgedCloud(Index max_points, Index most_encoded);
};

/// What one thread needs while it judges one pose.
struct JudgeScratch {
  kernels::Floats leaf_bounds;
  std::vector<Matches> matches;  // of one cloud's judged points
  kernels::Floats inputs;        // a column per judged point, source first
  kernels::Floats hidden[2];     // of the same points
  kernels::Floats pose_inputs, pose_hidden, logit;
};

struct JudgeWorkspace {
  const JudgeModel* model = nullptr;  // none: poses keep the score of their fit
  JudgedCloud cloud[2];
  std::vector<JudgeScratch> scratch;
  kernels::Floats recorded;  // inputs of all poses; kept only when stages are recorded

  JudgeWorkspace() = default;
  JudgeWorkspace(const JudgeModel* judge, Index max_points, Index encoded, Index threads,
                 bool record);
};

}  // namespace vnreg::detail
