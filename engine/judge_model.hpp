// The weights of the judge (docs/design.md, "The judge"), which a model of architecture `vnreg` may
// hold.
#pragma once

#include <optional>

#include "engine/tensor_set.hpp"
#include "kernels/linear.hpp"

namespace vnreg::detail {

/// What the judge is told of a point that a pose lays onto the other cloud, and of the pose.
inline constexpr Index judge_point_inputs = 33;
inline constexpr Index judge_pose_inputs = 3;

struct JudgeModel {
  kernels::Linear point[2];
  kernels::Linear pose[2];
};

/// Empty where the file has no `channels.judge`. Throws Error: wrong_architecture, missing_tensor.
std::optional<JudgeModel> read_judge_model(const model_format::ModelFile& file, TensorSet& tensors);

}  // namespace vnreg::detail
