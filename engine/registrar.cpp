// The pipeline, in the order in which data flows (docs/design.md).
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "engine/cloud.hpp"
#include "engine/coarse.hpp"
#include "engine/confidence.hpp"
#include "engine/covariance.hpp"
#include "engine/descriptor_encoder.hpp"
#include "engine/encoder.hpp"
#include "engine/explain.hpp"
#include "engine/fine.hpp"
#include "engine/model_data.hpp"
#include "engine/neighbourhood.hpp"
#include "engine/options.hpp"
#include "engine/prepared_cloud.hpp"
#include "engine/residual.hpp"
#include "engine/stopwatch.hpp"
#include "engine/user_pose.hpp"
#include "engine/verified.hpp"
#include "engine/workspace.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {
namespace detail {

using kernels::RigidTransform;

/// A cloud as it comes in. What another kind of registrar has prepared counts as points.
struct Input {
  PointsView points;
  const PreparedData* prepared;  // if not null, that counts
};

struct RegistrarState {
  RegistrarState(Model m, const Options& o, Index points)
      : model(std::move(m)), options(o), max_points(points), workspace(model.data(), o, points) {}

  Input input(const CloudRef& cloud) const noexcept;
  const Result& align(const CloudRef& source, const CloudRef& target) noexcept;
  std::shared_ptr<const PreparedData> prepare(const PointsView& points);

  Model model;
  Options options;
  Index max_points;
  Workspace workspace;
  Result result;
};

namespace {

// A cloud whose radius exceeds a prepared one's by no more is measured in the prepared one's unit.
constexpr double most_excess = 1.25;

/// The worse of both statuses, in the order of the checks.
Status first_failure(Status source, Status target) noexcept {
  for (const Status s : {Status::too_few_points, Status::not_finite, Status::degenerate}) {
    if (source == s || target == s) return s;
  }
  return Status::ok;
}

/// The length that is 1 in network coordinates, if a cloud of this r.m.s. radius sets it.
double scale_of(const ModelData& model, double radius) noexcept {
  return model.arch.rms_radius == 0.0 ? 1.0 : radius / model.arch.rms_radius;
}

/// The r.m.s. radius that sets the pair's scale: the larger one, unless a prepared cloud is nearly
/// as large. w.sides becomes the clouds that have to be computed in that scale.
double choose_radius(const Input inputs[2], Workspace& w) noexcept {
  const double radius[2] = {w.cloud[0].rms_radius, w.cloud[1].rms_radius};
  const Index larger = radius[0] >= radius[1] ? 0 : 1;
  const bool smaller_sets = inputs[larger].prepared == nullptr &&
                            inputs[1 - larger].prepared != nullptr &&
                            radius[larger] <= most_excess * radius[1 - larger];
  const double chosen = smaller_sets ? radius[1 - larger] : radius[larger];
  const auto fits = [&](Index side) {
    return inputs[side].prepared != nullptr && radius[side] == chosen;
  };
  w.sides = both_sides;
  if (fits(1)) w.sides = w.sides.first(1);
  if (fits(0)) w.sides = w.sides.subspan(1);
  return chosen;
}

Gathering gathering(const ModelData& model, const Options& options) noexcept {
  return {model.arch.min_points(), options.seed, options.drop_non_finite};
}

/// The points used, centroid and radius.
Status take(const ModelData& model, const Options& options, const Input& input, Workspace& w,
            Cloud& cloud) noexcept {
  if (input.prepared == nullptr) {
    return gather(input.points, gathering(model, options), w.deadline, cloud);
  }
  cloud.count = input.prepared->cloud.count;
  cloud.dropped = input.prepared->cloud.dropped;
  if (input.prepared->status == Status::ok) cloud = input.prepared->cloud;
  return input.prepared->status;
}

Status unfinished(const Deadline& deadline) noexcept {
  return deadline.cancelled() ? Status::cancelled : Status::timed_out;
}

/// Points to network coordinates and neighbourhoods.
Status prepare(const ModelData& model, const Options& options, const Input inputs[2], Workspace& w,
               double& scale) noexcept {
  Status status[2];
  for (Cloud& cloud : w.cloud) {
    cloud.count = 0;
    cloud.dropped = 0;
  }
  parallel_for(w.threads, 2, [&](Index side, int) {
    status[side] = take(model, options, inputs[side], w, w.cloud[side]);
  });
  if (w.deadline.expired()) return unfinished(w.deadline);
  if (const Status s = first_failure(status[0], status[1]); s != Status::ok) return s;
  const double radius = choose_radius(inputs, w);
  scale = scale_of(model, radius);
  if (!std::isfinite(scale) || scale == 0.0) return Status::degenerate;
  w.verified.radius = radius / scale;
  for (const Index side : w.sides) {
    if (!normalize(scale, w.cloud[side])) return Status::degenerate;
  }
  find_neighbourhoods(model, w);
  return w.deadline.expired() ? unfinished(w.deadline) : Status::ok;
}

/// The features that the coarse register needs, and with architecture `vnreg` all others.
void encode(const ModelData& model, const Options& options, Workspace& w) noexcept {
  if (!model.descriptor_model) return encode_global(model, w);
  encode_descriptors(*model.descriptor_model, w.cloud, w.sides, options.seed, w.threads,
                     w.descriptors, w.recorder);
  for (const Index side : w.sides) {
    w.features[side].global = w.descriptors.features[side].out.global;
  }
}

bool finite(const Pose& pose) noexcept {
  return Eigen::Map<const Eigen::Matrix<double, 16, 1>>(pose.data()).allFinite();
}

/// The deadline has passed: the pose found until then (or null), which nothing has judged.
Status give_up(const RigidTransform* found, double scale, const Workspace& w,
               Result& result) noexcept {
  const Status status = unfinished(w.deadline);
  if (found == nullptr || status == Status::cancelled) return status;
  const Pose pose = user_pose(*found, scale, w.cloud);
  if (!finite(pose)) return status;
  result.has_pose = true;
  result.T_target_source = pose;
  return status;
}

/// What mode verified says about its answer, the first of the poses, and the other ones.
Status judge(const VerifiedPoses& poses, const ModelData& model, double scale, const Workspace& w,
             Result& result) noexcept {
  result.score = poses.pose[0].score;
  for (Index i = 1; i < poses.count; ++i) {
    const ScoredPose& other = poses.pose[i];
    result.alternatives.push_back({user_pose(other.transform, scale, w.cloud), other.score});
  }
  const Uncertainty uncertainty = measure_uncertainty(poses.pose[0].transform, w.verified);
  result.covariance = user_covariance(uncertainty, model.covariance_inflation, scale, w.cloud[1]);
  result.evidence = collect_evidence(poses, uncertainty, w.verified);
  result.confidence = confidence(model.verified_calibration, result.evidence);
  // Before low confidence, because it says more: which other poses it may be.
  if (ambiguous(poses)) return Status::ambiguous;
  return result.confidence < 0.5 ? Status::low_confidence : Status::ok;
}

/// Whether the clouds' sizes say that their units differ, or that one is but a small part.
bool scales_differ(const Cloud cloud[2]) noexcept {
  constexpr double most = 3;
  const double a = cloud[0].rms_radius, b = cloud[1].rms_radius;
  return std::max(a, b) > most * std::min(a, b);
}

/// Everything but the total time. Leaves `result` without a pose unless it has a finite one.
Status run(const ModelData& model, const Options& options, const Input inputs[2], Workspace& w,
           Result& result) noexcept {
  Stopwatch watch;
  double scale = 1;
  const Status prepared = prepare(model, options, inputs, w, scale);
  result.points_source = static_cast<std::size_t>(w.cloud[0].count);
  result.points_target = static_cast<std::size_t>(w.cloud[1].count);
  result.dropped_source = w.cloud[0].dropped;
  result.dropped_target = w.cloud[1].dropped;
  result.ms.prepare = watch.lap();
  if (prepared != Status::ok) return prepared;

  encode(model, options, w);
  for (Index side = 0; side < 2; ++side) {
    if (!contains(w.sides, side)) load_features(*inputs[side].prepared, side, w);
  }
  result.ms.encode = watch.lap();
  if (w.deadline.expired()) return unfinished(w.deadline);
  w.reached.scale = scale;
  w.reached.described = model.descriptor_model.has_value();
  const CoarsePose coarse = register_coarse(model, w);
  result.ms.coarse = watch.lap();
  // A symmetric cloud may leave the features without a rotation, but not its points.
  if (!coarse.determined && options.mode != Mode::verified) return Status::degenerate;
  const RigidTransform coarse_transform = coarse.determined ? coarse.transform : RigidTransform{};
  const Pose coarse_pose = user_pose(coarse_transform, scale, w.cloud);

  RigidTransform transform = coarse_transform;
  if (w.local && coarse.determined) {
    encode_local(model, w);
    w.reached.described = !w.deadline.expired();
    result.ms.encode += watch.lap();
    transform = register_fine(model, coarse.transform, w);
    result.ms.fine = watch.lap();
    if (w.deadline.expired()) return give_up(&coarse.transform, scale, w, result);
  }
  VerifiedPoses poses;
  if (options.mode == Mode::verified) {
    const RigidTransform proposals[most_proposals] = {coarse_transform, transform};
    const std::size_t count = !coarse.determined ? 0 : w.local ? 2 : 1;
    poses = register_verified({proposals, count}, options.seed, w, result.ms);
    if (w.deadline.expired()) {
      return give_up(poses.count > 0 ? &poses.pose[0].transform : nullptr, scale, w, result);
    }
    if (poses.count == 0) return Status::degenerate;
    transform = poses.pose[0].transform;
    watch.lap();  // register_verified has taken its own times
  }
  const Pose pose = user_pose(transform, scale, w.cloud);
  if (!finite(pose) || !finite(coarse_pose)) return Status::degenerate;

  const Residual residual = measure_residual(transform, w);
  if (w.deadline.passed()) return give_up(&transform, scale, w, result);
  result.has_pose = true;
  result.T_target_source = pose;
  result.T_target_source_coarse = coarse_pose;
  result.overlap = residual.overlap;
  result.rmse = residual.rmse * scale;
  result.inlier_distance = residual.inlier_distance * scale;
  Status status = Status::ok;
  if (options.mode == Mode::verified) {
    status = judge(poses, model, scale, w, result);
  } else {
    result.confidence = confidence(model.calibration, residual);
    if (result.confidence < 0.5) status = Status::low_confidence;
  }
  if (scales_differ(w.cloud)) status = Status::scales_differ;
  result.ms.measure = watch.lap();
  return status;
}

/// All that a side can have alone, with the other one empty.
Status run_alone(const ModelData& model, const Options& options, const PointsView& points,
                 Workspace& w) noexcept {
  constexpr Index side = 0;
  const Status gathered = gather(points, gathering(model, options), w.deadline, w.cloud[side]);
  if (w.deadline.expired()) return unfinished(w.deadline);
  if (gathered != Status::ok) return gathered;
  const double radius = w.cloud[side].rms_radius;
  const double scale = scale_of(model, radius);
  if (!std::isfinite(scale) || scale == 0.0 || !normalize(scale, w.cloud[side])) {
    return Status::degenerate;
  }
  w.verified.radius = radius / scale;
  w.sides = Sides(both_sides).first(1);
  find_neighbourhoods(model, w);
  encode(model, options, w);
  if (w.local) encode_local(model, w);
  if (options.mode == Mode::verified) fit_surfaces(w);
  return w.deadline.expired() ? unfinished(w.deadline) : Status::ok;
}

}  // namespace

Input RegistrarState::input(const CloudRef& cloud) const noexcept {
  const PreparedData* prepared = cloud.prepared();
  if (prepared == nullptr) return {cloud.points(), nullptr};
  const bool usable =
      prepared->status != Status::ok || prepared->serves(model.data(), options, max_points);
  return {prepared->points(), usable ? prepared : nullptr};
}

const Result& RegistrarState::align(const CloudRef& source, const CloudRef& target) noexcept {
  Stopwatch watch;
  result = Result{};
  workspace.reached = {};
  workspace.deadline.start(options);
  workspace.recorder.clear();
  const Input inputs[2] = {input(source), input(target)};
  result.status = run(model.data(), options, inputs, workspace, result);
  workspace.reached.answered = true;
  result.ms.total = watch.lap();
  return result;
}

std::shared_ptr<const PreparedData> RegistrarState::prepare(const PointsView& points) {
  workspace.reached = {};
  workspace.deadline.start(options);
  auto prepared = std::make_shared<PreparedData>(model, options, max_points);
  prepared->status = run_alone(model.data(), options, points, workspace);
  store(workspace, 0, *prepared);
  workspace.recorder.clear();
  return prepared;
}

}  // namespace detail

Registrar::Registrar(Model model, Options options) {
  const detail::Index max_points = detail::checked_max_points(model.data(), options);
  state_ = std::make_unique<detail::RegistrarState>(std::move(model), options, max_points);
}

Registrar::~Registrar() = default;
Registrar::Registrar(Registrar&&) noexcept = default;
Registrar& Registrar::operator=(Registrar&&) noexcept = default;

const Result& Registrar::align(CloudRef source, CloudRef target) noexcept {
  return state_->align(source, target);
}

PreparedCloud Registrar::prepare(PointsView cloud) { return PreparedCloud(state_->prepare(cloud)); }

const std::vector<Stage>& Registrar::stages() const noexcept {
  return state_->workspace.recorder.stages();
}

Explanation Registrar::explain() const {
  return detail::explain(state_->workspace, state_->result);
}

}  // namespace vnreg
