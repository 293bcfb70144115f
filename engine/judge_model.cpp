#include "engine/judge_model.hpp"

namespace vnreg::detail {

std::optional<JudgeModel> read_judge_model(const model_format::ModelFile& file,
                                           TensorSet& tensors) {
  constexpr const char* key = "channels.judge";
  if (!file.has(key)) return std::nullopt;
  const auto hidden = static_cast<Index>(file.get_u64(key, 1, 512));
  return JudgeModel{{tensors.linear("judge.point.0", hidden, judge_point_inputs),
                     tensors.linear("judge.point.1", hidden, hidden)},
                    {tensors.linear("judge.pose.0", hidden, hidden + judge_pose_inputs),
                     tensors.linear("judge.pose.1", 1, hidden)}};
}

}  // namespace vnreg::detail
