#include "engine/judge.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "engine/judge_inputs.hpp"

namespace vnreg::detail {
namespace {

using kernels::padded;

// Poses whose log-odds are less than this below the best one's are looked at closer, the best ones
// of them.
constexpr double doubt = 6.0;
constexpr Index most_doubted = 4;

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

/// Log-odds of the `which` poses by the first `points` points of each cloud.
void look(std::span<const Index> which, Index points, const ScoredPose* poses, double* judged,
          Workspace& w) noexcept {
  JudgeWorkspace& judge = w.verified.judge;
  parallel_for(w.threads, static_cast<Index>(which.size()), [&](Index k, int thread) {
    const Index i = which[static_cast<std::size_t>(k)];
    JudgeScratch& s = judge.scratch[static_cast<std::size_t>(thread)];
    const Index columns = write_judge_inputs(to_motion(poses[i].transform), points, w, s);
    judged[i] = log_odds(*judge.model, columns, static_cast<float>(poses[i].score), w.verified, s);
  });
}

/// Looks at more points where several poses may be the right one. What is left out stays behind.
void look_closer(const ScoredPose* poses, Index count, double* judged, Workspace& w) noexcept {
  Index order[final_poses];
  std::iota(order, order + count, Index{0});
  const Index most = std::min(count, most_doubted);
  std::partial_sort(order, order + most, order + count,
                    [&](Index a, Index b) { return judged[a] > judged[b]; });
  const double least = judged[order[0]] - doubt;
  Index close = 1;
  while (close < most && judged[order[close]] > least) ++close;
  if (close < 2) return;
  describe_judged_points(judged_points, most_judged_points, w);
  look({order, static_cast<std::size_t>(close)}, most_judged_points, poses, judged, w);
  if (w.deadline.expired()) return;
  const auto smaller = [&](Index a, Index b) { return judged[a] < judged[b]; };
  const double behind = judged[*std::min_element(order, order + close, smaller)];
  for (Index k = close; k < count; ++k) {
    judged[order[k]] = std::min(judged[order[k]], behind);
  }
}

/// What the judge is trained on: the poses (rows of (R | t), network coordinates), their fits and
/// the inputs of all points that it may look at, whether or not it did.
void record(const ScoredPose* poses, const double* first, const double* judged, Index count,
            Workspace& w) noexcept {
  constexpr Index numbers = 12;
  JudgeWorkspace& judge = w.verified.judge;
  float rows[final_poses * numbers], fits[final_poses], log_odds[2][final_poses];
  describe_judged_points(0, most_judged_points, w);
  Index columns = 0;
  for (Index i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> row(rows + i * numbers);
    row.leftCols<3>() = poses[i].transform.rotation.cast<float>();
    row.col(3) = (w.verified.radius * poses[i].transform.translation).cast<float>();
    fits[i] = static_cast<float>(poses[i].score);
    log_odds[0][i] = static_cast<float>(first[i]);
    log_odds[1][i] = static_cast<float>(judged[i]);
    columns =
        write_judge_inputs(to_motion(poses[i].transform), most_judged_points, w, judge.scratch[0]);
    const Index size = columns * padded(judge_point_inputs);
    std::copy_n(judge.scratch[0].inputs.data(), size, judge.recorded.data() + i * size);
  }
  w.recorder.matrix("judge.", "poses", rows, numbers, numbers, count);
  w.recorder.list("judge.", "fit", fits, count);
  const auto source_points = static_cast<float>(judge.cloud[0].points.count);
  w.recorder.list("judge.", "source_points", &source_points, 1);
  if (judge.model != nullptr) {
    w.recorder.list("judge.", "first_log_odds", log_odds[0], count);
    w.recorder.list("judge.", "log_odds", log_odds[1], count);
  }
  w.recorder.matrix("judge.", "inputs", judge.recorded.data(), padded(judge_point_inputs),
                    judge_point_inputs, count * columns);
}

/// Log-odds of all poses, at the first look and in the end.
void judge_all(const ScoredPose* poses, Index count, double* first, double* judged,
               Workspace& w) noexcept {
  if (w.verified.judge.model == nullptr || count == 0) return;
  Index all[final_poses];
  std::iota(all, all + count, Index{0});
  look({all, static_cast<std::size_t>(count)}, judged_points, poses, first, w);
  std::copy_n(first, count, judged);
  if (!w.deadline.expired()) look_closer(poses, count, judged, w);
}

}  // namespace

void begin_judging(Workspace& w) noexcept {
  const JudgeWorkspace& judge = w.verified.judge;
  if (judge.scratch.empty() || (judge.model == nullptr && !w.recorder.enabled())) return;
  choose_judged_points(w);
  describe_judged_points(0, judged_points, w);
}

bool judge_poses(ScoredPose* poses, Index count, Workspace& w) noexcept {
  const JudgeWorkspace& judge = w.verified.judge;
  if (judge.scratch.empty() || judge.model == nullptr) return false;
  double first[final_poses] = {}, judged[final_poses] = {};
  judge_all(poses, count, first, judged, w);
  if (w.deadline.expired()) return false;
  for (Index i = 0; i < count; ++i) poses[i].score = judged[i];
  return true;
}

void record_judgement(const ScoredPose* fits, Index count, Workspace& w) noexcept {
  if (w.verified.judge.scratch.empty() || !w.recorder.enabled()) return;
  double first[final_poses] = {}, judged[final_poses] = {};
  judge_all(fits, count, first, judged, w);
  record(fits, first, judged, count, w);
}

}  // namespace vnreg::detail
