#include "engine/confidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/verify.hpp"

namespace vnreg::detail {
namespace {

double sigmoid(double x) noexcept { return 1 / (1 + std::exp(-x)); }

/// How far the best pose stands out: 1 alone, 0 beside one that is as good. 1 less the ratio of the
/// odds, or of the fits.
double margin_of(const VerifiedPoses& poses) noexcept {
  if (poses.count < 2) return 1;
  const double best = poses.pose[0].score;
  if (poses.judged) return -std::expm1(poses.pose[1].score - best);
  return best > 0 ? std::clamp(1 - poses.pose[1].score / best, 0.0, 1.0) : 0;
}

/// Of both clouds, in spacings.
double noise_of(const VerifiedWorkspace& v) noexcept {
  double squares = 0;
  for (const Surface& s : v.surface) squares += std::pow(static_cast<double>(s.noise), 2) / 2;
  return std::sqrt(squares) / static_cast<double>(v.spacing);
}

}  // namespace

double confidence(const std::optional<Calibration>& calibration,
                  const Residual& residual) noexcept {
  if (!calibration) return std::numeric_limits<double>::quiet_NaN();
  const double relative =
      residual.inlier_distance > 0 ? residual.rmse / residual.inlier_distance : 0.0;
  return sigmoid(calibration->bias + calibration->overlap * residual.overlap +
                 calibration->residual * relative);
}

double confidence(const std::optional<VerifiedCalibration>& calibration,
                  const Evidence& evidence) noexcept {
  if (!calibration) return std::numeric_limits<double>::quiet_NaN();
  const auto values = evidence.values();
  double sum = calibration->bias;
  for (std::size_t i = 0; i < values.size(); ++i) sum += calibration->weights[i] * values[i];
  return sigmoid(sum);
}

Evidence collect_evidence(const VerifiedPoses& poses, const Uncertainty& uncertainty,
                          const VerifiedWorkspace& v) noexcept {
  const kernels::RigidTransform& pose = poses.pose[0].transform;
  const Fit fit = two_sided_fit(to_motion({pose.rotation, pose.translation / v.radius}), v.surface,
                                most_surface_points, v.spacing, Search::exact);
  return {.score = poses.pose[0].score,
          .margin = margin_of(poses),
          .covered = static_cast<double>(1 - fit.unmatched),
          .contradicted = static_cast<double>(fit.unmatched - fit.beyond),
          .beyond = static_cast<double>(fit.beyond),
          .residual = uncertainty.residual,
          .noise = noise_of(v),
          .certainty = uncertainty.certainty};
}

}  // namespace vnreg::detail
