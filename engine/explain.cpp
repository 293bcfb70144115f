#include "engine/explain.hpp"

#include <algorithm>
#include <limits>

#include "engine/user_pose.hpp"

namespace vnreg::detail {
namespace {

Explanation::Point point_at(const Cloud& cloud, std::uint32_t index, float logit) {
  const double* xyz = cloud.xyz.data() + 3 * std::size_t{index};
  return {{xyz[0], xyz[1], xyz[2]}, static_cast<double>(kernels::sigmoid(logit))};
}

/// The encoded points (architecture `vnreg`), or all (`paper`).
std::vector<Explanation::Point> described_points(const Workspace& w, std::size_t side) {
  const Cloud& cloud = w.cloud[side];
  const CloudDescriptors& d = w.descriptors.features[side].out;
  const bool encoded = d.count > 0;
  std::vector<Explanation::Point> points(static_cast<std::size_t>(encoded ? d.count : cloud.count));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] =
        encoded ? point_at(cloud, d.encoded[i], d.significance[i])
                : point_at(cloud, static_cast<std::uint32_t>(i), w.features[side].significance[i]);
  }
  return points;
}

/// Those of the last iteration of the fine register, without weightless ones.
void add_fine_matches(const FineBuffers& fine, std::vector<Explanation::Match>& matches) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(fine.kept[0].count); ++i) {
    if (!(fine.weights[i] > 0)) continue;
    matches.push_back({fine.kept[0].original[i], fine.kept[1].original[fine.match[i]],
                       static_cast<double>(fine.weights[i])});
  }
}

std::vector<Explanation::Match> matches_of(const Workspace& w) {
  std::vector<Explanation::Match> matches;
  for (const Match& match : w.verified.match.matches) {
    matches.push_back({match.source, match.target, static_cast<double>(match.weight)});
  }
  if (w.local) add_fine_matches(w.fine, matches);
  std::stable_sort(matches.begin(), matches.end(),
                   [](const auto& a, const auto& b) { return a.weight > b.weight; });
  return matches;
}

/// Sum of squared differences.
double difference(const Pose& a, const Pose& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

/// The answer was refined once more after it had been chosen: puts it in the place of the pose that
/// it was chosen as.
void take_answer(const Alternative& answer, std::vector<Alternative>& hypotheses) {
  const auto nearer = [&](const Alternative& a, const Alternative& b) {
    if ((a.score == answer.score) != (b.score == answer.score)) return a.score == answer.score;
    return difference(a.T_target_source, answer.T_target_source) <
           difference(b.T_target_source, answer.T_target_source);
  };
  const auto chosen = std::min_element(hypotheses.begin(), hypotheses.end(), nearer);
  if (chosen != hypotheses.end()) *chosen = answer;
}

/// Mode verified.
std::vector<Alternative> considered_poses(const Workspace& w, const Result& result) {
  std::vector<Alternative> poses;
  for (Index i = 0; i < w.reached.considered; ++i) {
    const ScoredPose& pose = w.verified.considered[i];
    const kernels::RigidTransform network{pose.transform.rotation,
                                          w.verified.radius * pose.transform.translation};
    poses.push_back({user_pose(network, w.reached.scale, w.cloud), pose.score});
  }
  if (result.has_pose && result.status != Status::timed_out) {
    take_answer({result.T_target_source, result.score}, poses);
    for (const Alternative& other : result.alternatives) take_answer(other, poses);
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.score > b.score; });
  return poses;
}

/// Modes coarse and paper.
std::vector<Alternative> register_poses(const Result& result) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<Alternative> poses;
  if (!result.has_pose) return poses;
  poses.push_back({result.T_target_source, unknown});
  const bool fine = result.T_target_source_coarse != result.T_target_source;
  if (fine && result.status != Status::timed_out) {
    poses.push_back({result.T_target_source_coarse, unknown});
  }
  return poses;
}

}  // namespace

Explanation explain(const Workspace& w, const Result& result) {
  Explanation explanation;
  if (!w.reached.answered) return explanation;
  if (w.reached.described) {
    explanation.source = described_points(w, 0);
    explanation.target = described_points(w, 1);
    if (w.reached.matched) explanation.matches = matches_of(w);
  }
  explanation.hypotheses =
      w.reached.considered > 0 ? considered_poses(w, result) : register_poses(result);
  return explanation;
}

}  // namespace vnreg::detail
