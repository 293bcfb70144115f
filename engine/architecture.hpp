// Which network a model holds, and the hyper-parameters of architecture `paper` (docs/design.md).
#pragma once

#include <array>
#include <optional>
#include <string>

#include "kernels/packets.hpp"
#include "model_format/model_file.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

using kernels::Index;

enum class Family { paper, vnreg };

/// Of architecture `vnreg` only what both networks share is here: family, name, the rows of the
/// global feature, rms_radius, points, and as `neighbours` the two that give the points' spacing.
/// The rest of its hyper-parameters are in DescriptorArchitecture.
struct Architecture {
  Family family = Family::paper;
  std::string name;
  Index channels_global = 0;
  Index channels_local = 0;
  Index channels_descriptor = 0;
  Index channels_pair = 0;
  Index channels_significance[2] = {0, 0};
  Index neighbours = 0;
  bool shared_direction = false;
  /// Ablations of the paper, true in every network that is in use: whether the local module goes on
  /// from the encoder's latent, and whether descriptors are made by the invariant layer.
  bool shared_encoder = true;
  bool invariant_layer = true;
  Index fine_iterations = 0;
  Index keep_divisor = 0;
  double rms_radius = 0;
  Index points = 0;

  /// The fewest points a cloud must have.
  Index min_points() const noexcept;
};

/// confidence = sigmoid(bias + overlap * overlap + residual * (rmse / inlier_distance)).
struct Calibration {
  double bias = 0;
  double overlap = 0;
  double residual = 0;
};

/// confidence = sigmoid(bias + sum of weight * value over the evidence, in the order of its names).
struct VerifiedCalibration {
  double bias = 0;
  std::array<double, Evidence::names.size()> weights{};
};

/// Throws Error (wrong_architecture) for an absent key, another type or a value out of range.
Architecture read_architecture(const model_format::ModelFile& file);

/// All three keys, or none.
std::optional<Calibration> read_calibration(const model_format::ModelFile& file);

/// The bias and a weight for every name of the evidence, or none of them.
std::optional<VerifiedCalibration> read_verified_calibration(const model_format::ModelFile& file);

/// What the covariance is to be multiplied by; 1 where the file does not say.
double read_covariance_inflation(const model_format::ModelFile& file);

}  // namespace vnreg::detail
