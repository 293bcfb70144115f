// The probability that a pose is right, by a logistic model of what is known about it.
#pragma once

#include "engine/covariance.hpp"
#include "engine/model_data.hpp"
#include "engine/residual.hpp"
#include "engine/verified.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

/// Modes coarse and paper; NaN without a calibration.
double confidence(const std::optional<Calibration>& calibration, const Residual& residual) noexcept;

/// Mode verified; NaN without a calibration.
double confidence(const std::optional<VerifiedCalibration>& calibration,
                  const Evidence& evidence) noexcept;

/// What speaks for the best of the poses (at least one), and against it. Finite.
Evidence collect_evidence(const VerifiedPoses& poses, const Uncertainty& uncertainty,
                          const VerifiedWorkspace& workspace) noexcept;

}  // namespace vnreg::detail
