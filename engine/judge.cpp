#include "engine/judge.hpp"

#include <algorithm>

#include "engine/judge_inputs.hpp"

namespace vnreg::detail {
namespace {

using kernels::padded;

/// Mean over the columns.
void mean_of(const float* values, Index rows, Index columns, float* mean) noexcept {
  using Features = Eigen::Map<const Eigen::MatrixXf>;
  Eigen::Map<Eigen::VectorXf>(mean, rows) = Features(values, rows, columns).rowwise().mean();
}

/// Two layers for every point, their mean, and two layers for the pose.
float log_odds(const JudgeModel& model, Index columns, float fit, const VerifiedWorkspace& v,
               JudgeScratch& s) noexcept {
  const Index hidden = model.point[0].padded_rows();
  kernels::linear(model.point[0], s.inputs.data(), padded(judge_point_inputs), columns,
                  s.hidden[0].data());
  kernels::relu(s.hidden[0].data(), hidden * columns);
  kernels::linear(model.point[1], s.hidden[0].data(), hidden, columns, s.hidden[1].data());
  kernels::relu(s.hidden[1].data(), hidden * columns);
  const Index features = model.point[1].weights.rows();
  mean_of(s.hidden[1].data(), hidden, columns, s.pose_inputs.data());
  float* rest = s.pose_inputs.data() + features;
  rest[0] = fit;
  rest[1] = v.spacing;
  rest[2] = (v.surface[0].noise + v.surface[1].noise) / (2 * v.spacing);
  kernels::linear(model.pose[0], s.pose_inputs.data(), padded(features + judge_pose_inputs), 1,
                  s.pose_hidden.data());
  kernels::relu(s.pose_hidden.data(), model.pose[0].padded_rows());
  kernels::linear(model.pose[1], s.pose_hidden.data(), model.pose[0].padded_rows(), 1,
                  s.logit.data());
  return s.logit[0];
}

/// What the judge is trained on: the poses (rows of (R | t), network coordinates), their fits and
/// the inputs of their points.
void record(const ScoredPose* poses, const ScoredPose* judged, Index count, Index columns,
            Workspace& w) noexcept {
  constexpr Index numbers = 12;
  float rows[final_poses * numbers], fits[final_poses], log_odds[final_poses];
  for (Index i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> row(rows + i * numbers);
    row.leftCols<3>() = poses[i].transform.rotation.cast<float>();
    row.col(3) = (w.verified.radius * poses[i].transform.translation).cast<float>();
    fits[i] = static_cast<float>(poses[i].score);
    log_odds[i] = static_cast<float>(judged[i].score);
  }
  w.recorder.matrix("judge.", "poses", rows, numbers, numbers, count);
  w.recorder.list("judge.", "fit", fits, count);
  if (w.verified.judge.model != nullptr) w.recorder.list("judge.", "log_odds", log_odds, count);
  w.recorder.matrix("judge.", "inputs", w.verified.judge.recorded.data(),
                    padded(judge_point_inputs), judge_point_inputs, count * columns);
}

}  // namespace

bool judge_poses(ScoredPose* poses, Index count, Workspace& w) noexcept {
  JudgeWorkspace& judge = w.verified.judge;
  const bool recording = w.recorder.enabled();
  if (judge.scratch.empty() || (judge.model == nullptr && !recording)) return false;
  choose_judged_points(w);
  const Index columns = judge.cloud[0].points.count + judge.cloud[1].points.count;
  const Index stride = columns * padded(judge_point_inputs);
  ScoredPose judged[final_poses];
  parallel_for(w.threads, count, [&](Index i, int thread) {
    JudgeScratch& s = judge.scratch[static_cast<std::size_t>(thread)];
    write_judge_inputs(to_motion(poses[i].transform), w, s);
    if (recording) std::copy_n(s.inputs.data(), stride, judge.recorded.data() + i * stride);
    judged[i] = poses[i];
    if (judge.model == nullptr) return;
    judged[i].score = static_cast<double>(
        log_odds(*judge.model, columns, static_cast<float>(poses[i].score), w.verified, s));
  });
  if (recording) record(poses, judged, count, columns, w);
  if (judge.model == nullptr || w.deadline.expired()) return false;
  std::copy_n(judged, count, poses);
  return true;
}

}  // namespace vnreg::detail
