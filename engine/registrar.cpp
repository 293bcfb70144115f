// The pipeline, in the order in which data flows (docs/design.md).
#include <cmath>
#include <span>
#include <utility>

#include "engine/cloud.hpp"
#include "engine/coarse.hpp"
#include "engine/confidence.hpp"
#include "engine/covariance.hpp"
#include "engine/cpu.hpp"
#include "engine/descriptor_encoder.hpp"
#include "engine/encoder.hpp"
#include "engine/fine.hpp"
#include "engine/model_data.hpp"
#include "engine/neighbourhood.hpp"
#include "engine/residual.hpp"
#include "engine/stopwatch.hpp"
#include "engine/verified.hpp"
#include "engine/workspace.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {
namespace detail {

using kernels::RigidTransform;

struct RegistrarState {
  RegistrarState(Model m, const Options& o, Index max_points)
      : model(std::move(m)), options(o), workspace(model.data(), o, max_points) {}

  Model model;
  Options options;
  Workspace workspace;
  Result result;
};

namespace {

/// The worse of both statuses, in the order of the checks.
Status first_failure(Status source, Status target) noexcept {
  for (const Status s : {Status::too_few_points, Status::not_finite, Status::degenerate}) {
    if (source == s || target == s) return s;
  }
  return Status::ok;
}

/// One length for both clouds; 0 when it is not a positive number.
double common_scale(const ModelData& model, const Cloud cloud[2]) noexcept {
  if (model.arch.rms_radius == 0.0) return 1.0;
  const double scale = std::max(cloud[0].rms_radius, cloud[1].rms_radius) / model.arch.rms_radius;
  return std::isfinite(scale) ? scale : 0.0;
}

/// Points to network coordinates and edge vectors.
Status prepare(const ModelData& model, const Options& options, const PointsView clouds[2],
               Workspace& w, double& scale) noexcept {
  Status status[2];
  parallel_for(w.threads, 2, [&](Index side, int) {
    status[side] = gather(clouds[side], model.arch.min_points(), options.seed, w.cloud[side]);
  });
  if (const Status s = first_failure(status[0], status[1]); s != Status::ok) return s;
  scale = common_scale(model, w.cloud);
  if (scale == 0.0) return Status::degenerate;
  for (Cloud& cloud : w.cloud) {
    if (!normalize(scale, cloud)) return Status::degenerate;
  }
  find_neighbourhoods(model, w);
  return Status::ok;
}

/// The features that the coarse register needs, and with architecture `vnreg` all others.
void encode(const ModelData& model, const Options& options, Workspace& w) noexcept {
  if (!model.descriptor_model) return encode_global(model, w);
  encode_descriptors(*model.descriptor_model, w.cloud, options.seed, w.threads, w.descriptors,
                     w.recorder);
  for (Index side = 0; side < 2; ++side) {
    w.features[side].global = w.descriptors.features[side].out.global;
  }
}

/// t_user = c_target + s t - R c_source.
Pose user_pose(const RigidTransform& network, double scale, const Cloud cloud[2]) noexcept {
  const Eigen::Vector3d source = Eigen::Map<const Eigen::Vector3d>(cloud[0].centroid);
  const Eigen::Vector3d target = Eigen::Map<const Eigen::Vector3d>(cloud[1].centroid);
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = decltype(matrix)::Identity();
  matrix.topLeftCorner<3, 3>() = network.rotation;
  matrix.topRightCorner<3, 1>() = target + scale * network.translation - network.rotation * source;
  Pose pose;
  Eigen::Map<decltype(matrix)>(pose.data()) = matrix;
  return pose;
}

bool finite(const Pose& pose) noexcept {
  return Eigen::Map<const Eigen::Matrix<double, 16, 1>>(pose.data()).allFinite();
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

/// Everything but the total time. Leaves `result` without a pose unless it has a finite one.
Status run(const ModelData& model, const Options& options, const PointsView clouds[2], Workspace& w,
           Result& result) noexcept {
  Stopwatch watch;
  double scale = 1;
  const Status prepared = prepare(model, options, clouds, w, scale);
  result.points_source = static_cast<std::size_t>(w.cloud[0].count);
  result.points_target = static_cast<std::size_t>(w.cloud[1].count);
  result.ms.prepare = watch.lap();
  if (prepared != Status::ok) return prepared;

  encode(model, options, w);
  result.ms.encode = watch.lap();
  const CoarsePose coarse = register_coarse(model, w);
  result.ms.coarse = watch.lap();
  // A symmetric cloud may leave the features without a rotation, but not its points.
  if (!coarse.determined && options.mode != Mode::verified) return Status::degenerate;
  const RigidTransform coarse_transform = coarse.determined ? coarse.transform : RigidTransform{};
  const Pose coarse_pose = user_pose(coarse_transform, scale, w.cloud);

  RigidTransform transform = coarse_transform;
  if (w.local && coarse.determined) {
    encode_local(model, w);
    result.ms.encode += watch.lap();
    transform = register_fine(model, coarse.transform, w);
    result.ms.fine = watch.lap();
  }
  VerifiedPoses poses;
  if (options.mode == Mode::verified) {
    const RigidTransform proposals[most_proposals] = {coarse_transform, transform};
    const std::size_t count = !coarse.determined ? 0 : w.local ? 2 : 1;
    poses = register_verified({proposals, count}, options.seed, w, result.ms);
    if (poses.count == 0) return Status::degenerate;
    transform = poses.pose[0].transform;
    watch.lap();  // register_verified has taken its own times
  }
  const Pose pose = user_pose(transform, scale, w.cloud);
  if (!finite(pose) || !finite(coarse_pose)) return Status::degenerate;

  const Residual residual = measure_residual(transform, w);
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
  result.ms.measure = watch.lap();
  return status;
}

void check_range(const char* field, int value, int min, int max, bool zero_allowed) {
  if ((zero_allowed && value == 0) || (value >= min && value <= max)) return;
  throw Error(ErrorCode::invalid_option, field,
              (zero_allowed ? "0 or " : "") + std::to_string(min) + " to " + std::to_string(max),
              std::to_string(value));
}

/// Checks the options against the model; returns the number of points to make room for.
Index checked_max_points(const ModelData& model, const Options& options) {
  if (options.mode != Mode::coarse && options.mode != Mode::paper &&
      options.mode != Mode::verified) {
    throw Error(ErrorCode::invalid_option, "mode", "coarse, paper or verified",
                std::to_string(static_cast<int>(options.mode)));
  }
  if (options.mode == Mode::paper && model.arch.fine_iterations == 0) {
    throw Error(ErrorCode::invalid_option, "mode",
                "coarse or verified (the model has no fine register)", "paper");
  }
  check_range("threads", options.threads, 1, 1024, true);
  const int fewest = std::max(64, static_cast<int>(model.arch.min_points()));
  check_range("max_points", options.max_points, fewest, 16384, true);
  return options.max_points == 0 ? model.arch.points : Index{options.max_points};
}

}  // namespace
}  // namespace detail

Registrar::Registrar(Model model, Options options) {
  detail::require_cpu();
  const detail::Index max_points = detail::checked_max_points(model.data(), options);
  state_ = std::make_unique<detail::RegistrarState>(std::move(model), options, max_points);
}

Registrar::~Registrar() = default;
Registrar::Registrar(Registrar&&) noexcept = default;
Registrar& Registrar::operator=(Registrar&&) noexcept = default;

const Result& Registrar::align(PointsView source, PointsView target) noexcept {
  detail::RegistrarState& s = *state_;
  detail::Stopwatch watch;
  s.result = Result{};
  s.workspace.recorder.clear();
  const PointsView clouds[2] = {source, target};
  s.result.status = detail::run(s.model.data(), s.options, clouds, s.workspace, s.result);
  s.result.ms.total = watch.lap();
  return s.result;
}

const std::vector<Stage>& Registrar::stages() const noexcept {
  return state_->workspace.recorder.stages();
}

Result align(PointsView source, PointsView target, const Options& options) {
  static const Model model = Model::builtin();
  return Registrar{model, options}.align(source, target);
}

}  // namespace vnreg
