#include "engine/verified.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/hypotheses.hpp"
#include "engine/judge.hpp"
#include "engine/match_hypotheses.hpp"
#include "engine/refine.hpp"
#include "engine/rigid.hpp"
#include "engine/shared_points.hpp"
#include "engine/stopwatch.hpp"
#include "engine/verify.hpp"

namespace vnreg::detail {
namespace {

using kernels::RigidTransform;

constexpr Index everything = most_surface_points;

// Lengths below are in spacings of the sparser surface, unless they say radii.

// Of the hypotheses from pairs, so many with the best probes are compared on more points.
constexpr Index compared_hypotheses = 600;
constexpr Index compared_points = 64;
constexpr float compared_tolerance = 1.9f;
constexpr Index leading_hypotheses = 64;
// What scores so much less than the best is not refined, and after the first refinement not
// further. (Validation shapes, eleven rows, two seeds: one answer of 1804 more is right with them.)
constexpr float compared_gap = 0.2f;
constexpr double refined_gap = 0.15;
// More than this a pose can only score where both clouds hold the same points. Whether the others
// fit their surfaces less well is not told by it.
constexpr float most_without_coincidence = 0.5f;
// Refinement of the best that differ by more than this.
constexpr double distinct_degrees = 8;
constexpr float distinct_radii = 0.15f;
constexpr RefineStage first_refinements[] = {{170, 3.8f, 6, Search::cell}};
constexpr Index second_points = 256;
constexpr float second_tolerance = 1.4f;
// Refinement on all points.
constexpr double final_degrees = 3;
constexpr float final_radii = 0.09f;
constexpr RefineStage final_refinements[] = {{512, 1.9f, 3, Search::cell},
                                             {everything, 1.0f, 4, Search::exact}};
constexpr float final_tolerance = 1.0f;
// Of the answer: the pose of the best, and of the alternatives.
constexpr RefineStage polish = {everything, 1.0f, 8, Search::exact};
// Where the judge gives no pose from matches better log-odds, or, without a judge, none fits
// better, they may be wrong for want of a right one: then pairs of points propose poses, too. There
// are many of them, so one is likely to fit a little better by chance; it has to fit better by
// `clear_gain`. (Validation shapes, five rows, four seeds, by the fit: 1397 of 1640 right when
// pairs always propose, 1413 without them, 1419 so. By the judge, ten rows, three seeds: 86.51 % of
// 2460 at -2 and -3, 86.47 at -4, 86.43 at -5; the first asks for pairs in half of the clouds of
// 512 points, for 4 ms.)
constexpr double doubtful_log_odds = -4;
constexpr double doubtful_fit = 0.05;
constexpr double clear_gain = 0.02;
// What the log-odds of a pose gain by points that both clouds hold, if it brings about as many of
// them together as the best does: more than two poses of one pair ever differ by. That surroundings
// and places are the same to the last digits is no accident. Half of them count as all: of samples
// that are symmetric themselves, each symmetry brings its own, and which of them were encoded is
// chance.
constexpr double shared_log_odds = 20;
constexpr double about_as_many = 0.5;
// Poses closer than this count as one answer.
constexpr double alternative_degrees = 15;
constexpr float alternative_radii = 0.1f;
// Below the best pose's score: how far an alternative may lie, and one so near that which of both
// is right cannot be told. Of the judge's log-odds; of fits, in parts of the best one's size.
struct Gaps {
  double alternative, ambiguous;
};
constexpr Gaps judged_gaps = {4.0, 1.0};
constexpr Gaps fit_gaps = {0.2, 0.03};

float cosine_of(double degrees) noexcept {
  return static_cast<float>(std::cos(degrees * std::numbers::pi / 180));
}

RigidTransform to_transform(const Motion& motion) noexcept {
  RigidTransform transform;
  transform.rotation =
      Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(motion.rotation).cast<double>();
  transform.translation = Eigen::Map<const Eigen::Vector3f>(motion.translation).cast<double>();
  return transform;
}

/// How far below the best score the gap reaches. Fits may be negative.
Gaps gaps_below(double best, bool judged) noexcept {
  if (judged) return judged_gaps;
  return {fit_gaps.alternative * std::abs(best), fit_gaps.ambiguous * std::abs(best)};
}

RigidTransform in_units(const RigidTransform& t, double factor) noexcept {
  return {t.rotation, factor * t.translation};
}

RefineStage scaled(RefineStage stage, float spacing) noexcept {
  stage.tolerance *= spacing;
  return stage;
}

bool by_score(const Hypothesis& a, const Hypothesis& b) noexcept { return better(a, b); }

/// Brings the hypotheses of all chunks of pairs together; leaves those with the best probes in
/// front. Returns their number.
Index gather_pair_hypotheses(VerifiedWorkspace& v) noexcept {
  Hypothesis* all = v.hypotheses.data();
  Index count = 0;
  for (Index chunk = 0; chunk < draw_chunks; ++chunk) {
    const Index kept = v.kept[static_cast<std::size_t>(chunk)];
    std::copy_n(all + chunk * kept_per_chunk, kept, all + count);
    count += kept;
  }
  const Index best = std::min(count, compared_hypotheses);
  std::nth_element(all, all + best, all + count, by_score);
  return best;
}

/// The first `count` motions from matches as hypotheses.
Index gather_match_hypotheses(Index count, VerifiedWorkspace& v) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    v.hypotheses[i] = {v.match.motions[i], 0, static_cast<std::uint32_t>(i)};
  }
  return count;
}

/// The least score that is worth refining, by the best one.
template <class Score>
Score least_worth(Score best, Score gap) noexcept {
  return std::min(best, Score{most_without_coincidence}) - gap;
}

/// Scores the hypotheses [first, last) by how well they explain a part of both surfaces; those that
/// cannot reach `least` by less than they deserve.
void score_hypotheses(Index first, Index last, float least, Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  Hypothesis* all = v.hypotheses.data();
  constexpr Index per_task = 16;
  parallel_for(w.threads, (last - first + per_task - 1) / per_task, [&](Index task, int) {
    const Index begin = first + task * per_task;
    for (Index i = begin; i < std::min(begin + per_task, last); ++i) {
      all[i].score = two_sided_fit(all[i].motion, v.surface, compared_points,
                                   compared_tolerance * v.spacing, Search::cell, least)
                         .score();
    }
  });
}

/// Sorts the first `count` hypotheses by their scores. The first of them set the limit below which
/// no one is looked at closely.
void compare_hypotheses(Index count, Workspace& w) noexcept {
  Hypothesis* all = w.verified.hypotheses.data();
  const Index first = std::min(count, leading_hypotheses);
  score_hypotheses(0, first, -std::numeric_limits<float>::infinity(), w);
  if (first < count) {
    const Hypothesis* best = std::min_element(all, all + first, by_score);
    score_hypotheses(first, count, least_worth(best->score, compared_gap), w);
  }
  std::sort(all, all + count, by_score);
}

/// Adds to the first `count` poses the best hypotheses that differ from each other.
Index add_distinct(const Hypothesis* hypotheses, Index available, Index count,
                   ScoredPose* poses) noexcept {
  const float cosine = cosine_of(distinct_degrees);
  Motion chosen[refined_poses];
  Index number = 0;
  for (Index i = 0; i < available && number < refined_poses; ++i) {
    if (hypotheses[i].score < least_worth(hypotheses[0].score, compared_gap)) break;
    const Motion& motion = hypotheses[i].motion;
    const bool known = std::any_of(chosen, chosen + number, [&](const Motion& other) {
      return similar(motion, other, cosine, distinct_radii);
    });
    if (known) continue;
    chosen[number++] = motion;
    poses[count++] = {to_transform(motion), hypotheses[i].score};
  }
  return count;
}

/// Sorts by score and drops poses that are similar to a better one, and those beyond `most`.
Index keep_distinct(ScoredPose* poses, Index count, Index most, double degrees,
                    float radii) noexcept {
  const float cosine = cosine_of(degrees);
  std::sort(poses, poses + count,
            [](const ScoredPose& a, const ScoredPose& b) { return a.score > b.score; });
  Index kept = 0;
  for (Index i = 0; i < count && kept < most; ++i) {
    const Motion motion = to_motion(poses[i].transform);
    const bool known = std::any_of(poses, poses + kept, [&](const ScoredPose& other) {
      return similar(motion, to_motion(other.transform), cosine, radii);
    });
    if (!known) poses[kept++] = poses[i];
  }
  return kept;
}

/// Takes the refined pose unless it explains less: the part of a surface that the other one lacks
/// may pull a pose that is right off its place.
void refine_if_better(std::span<const RefineStage> stages, Index points, float tolerance,
                      Search search, const VerifiedWorkspace& v, ScoredPose& pose) noexcept {
  const auto score_of = [&](const RigidTransform& transform) {
    return two_sided_fit(to_motion(transform), v.surface, points, tolerance * v.spacing, search)
        .score();
  };
  RigidTransform refined = pose.transform;
  for (const RefineStage& stage : stages) {
    refined = refine(refined, v.surface, scaled(stage, v.spacing));
  }
  const float before = score_of(pose.transform);
  const float after = score_of(refined);
  if (!(after < before)) pose.transform = refined;
  pose.score = std::max(before, after);
}

/// Refines the `given` poses and the best of the first hypotheses behind them. Leaves distinct
/// poses in front, the best first, and returns their number, at most final_poses.
Index settle(Index hypotheses, Index given, ScoredPose* poses, Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  compare_hypotheses(hypotheses, w);
  if (w.deadline.expired()) return 0;
  Index count = add_distinct(v.hypotheses.data(), hypotheses, given, poses);
  parallel_for(w.threads, count, [&](Index i, int) {
    refine_if_better(first_refinements, second_points, second_tolerance, Search::cell, v, poses[i]);
  });
  count = keep_distinct(poses, count, final_poses, final_degrees, final_radii);
  const double least = count > 0 ? least_worth(poses[0].score, refined_gap) : 0;
  count = std::find_if(poses, poses + count,
                       [&](const ScoredPose& pose) { return pose.score < least; }) -
          poses;
  parallel_for(w.threads, count, [&](Index i, int) {
    refine_if_better(final_refinements, everything, final_tolerance, Search::exact, v, poses[i]);
  });
  return keep_distinct(poses, count, final_poses, final_degrees, final_radii);
}

/// Adds those poses from pairs that are clearly better than the `known` ones; all, if none is
/// known. Leaves the best in front and returns the number of all.
Index add_pair_poses(Index known, Index given, ScoredPose* poses, Workspace& w) noexcept {
  ScoredPose* added = poses + known;
  Index count = settle(gather_pair_hypotheses(w.verified), given, added, w);
  if (known == 0) return count;
  const double least = poses[0].score + clear_gain;
  count = std::find_if(added, added + count,
                       [&](const ScoredPose& pose) { return pose.score < least; }) -
          added;
  return keep_distinct(poses, known + count, final_poses, final_degrees, final_radii);
}

/// Whether none of the poses seems right.
bool doubtful(const ScoredPose* poses, Index count, bool judged) noexcept {
  const double least = judged ? doubtful_log_odds : doubtful_fit;
  return std::none_of(poses, poses + count,
                      [&](const ScoredPose& pose) { return pose.score >= least; });
}

/// The pose that the points tell that both clouds hold, if there are enough of them.
Index add_shared_pose(Index count, ScoredPose* poses, Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  find_shared_points(w.descriptors.features[0].out, w.descriptors.features[1].out, v.shared);
  if (const auto motion = shared_motion(v.radius, v.shared)) {
    poses[count++] = {in_units(*motion, 1 / v.radius), 0};
  }
  return count;
}

/// Adds to log-odds what shared points say.
void favour_shared_points(ScoredPose* poses, Index count, VerifiedWorkspace& v) noexcept {
  Index together[final_poses];
  for (Index i = 0; i < count; ++i) {
    together[i] = brought_together(in_units(poses[i].transform, v.radius), v.radius, v.shared);
  }
  const Index most = count > 0 ? *std::max_element(together, together + count) : 0;
  if (most < least_shared_points) return;
  for (Index i = 0; i < count; ++i) {
    const double share = static_cast<double>(together[i]) / static_cast<double>(most);
    poses[i].score += shared_log_odds * std::min(share / about_as_many, 1.0);
  }
}

/// The pose of the answer: by the points that both clouds hold, or else by the surfaces.
RigidTransform polished(const RigidTransform& pose, VerifiedWorkspace& v) noexcept {
  const auto shared = shared_motion_near(in_units(pose, v.radius), v.radius, v.shared);
  if (shared) return in_units(*shared, 1 / v.radius);
  return refine(pose, v.surface, scaled(polish, v.spacing));
}

}  // namespace

VerifiedPoses register_verified(std::span<const RigidTransform> proposals, std::uint64_t seed,
                                Workspace& w, StageTimes& times) noexcept {
  VerifiedWorkspace& v = w.verified;
  Stopwatch watch;
  VerifiedPoses result;
  if (!build_surfaces(w)) return result;
  ScoredPose* poses = v.poses.data();
  Index given = 0, count = 0;
  for (const RigidTransform& pose : proposals) {
    poses[given++] = {in_units(pose, 1 / v.radius), 0};
  }
  const bool described = !v.match.motions.empty();
  if (described) {
    given = add_shared_pose(given, poses, w);
    const Index from_matches = propose_from_matches(w);
    times.hypotheses = watch.lap();
    count = settle(gather_match_hypotheses(from_matches, v), given, poses, w);
    given = 0;
    times.verify = watch.lap();
  }
  ScoredPose fits[final_poses];  // what is judged, with the score of the fit
  std::copy_n(poses, count, fits);
  begin_judging(w);
  result.judged = judge_poses(poses, count, w);
  if (!w.deadline.expired() && doubtful(poses, count, result.judged)) {
    std::copy_n(fits, count, poses);
    times.verify += watch.lap();
    propose_poses(seed, w);
    times.hypotheses += watch.lap();
    count = add_pair_poses(count, given, poses, w);
    std::copy_n(poses, count, fits);
    result.judged = judge_poses(poses, count, w);
  }
  record_judgement(fits, count, w);
  if (result.judged) favour_shared_points(poses, count, v);
  std::copy_n(poses, count, v.considered);
  w.reached.considered = count;
  count =
      keep_distinct(poses, count, VerifiedPoses::capacity, alternative_degrees, alternative_radii);
  const double least =
      count > 0 ? poses[0].score - gaps_below(poses[0].score, result.judged).alternative : 0;
  for (Index i = 0; i < count && poses[i].score >= least; ++i) {
    if (!w.deadline.passed()) {
      poses[i].transform = polished(poses[i].transform, v);
    }
    result.pose[result.count++] = {in_units(orthonormal(poses[i].transform), v.radius),
                                   poses[i].score};
  }
  times.verify += watch.lap();
  return result;
}

bool ambiguous(const VerifiedPoses& poses) noexcept {
  if (poses.count < 2) return false;
  const double best = poses.pose[0].score;
  return poses.pose[1].score >= best - gaps_below(best, poses.judged).ambiguous;
}

}  // namespace vnreg::detail
