// The weights of a model, checked against docs/design.md and packed once.
#pragma once

#include <array>
#include <optional>

#include "engine/architecture.hpp"
#include "engine/descriptor_model.hpp"
#include "engine/judge_model.hpp"
#include "kernels/invariant.hpp"
#include "kernels/linear.hpp"
#include "kernels/pair_features.hpp"
#include "kernels/vn_block.hpp"
#include "kernels/vn_linear.hpp"

namespace vnreg::detail {

/// The encoder (paper, section III-A). The first block of network 0 includes the linear layer
/// `pre`.
struct EncoderData {
  kernels::EdgeBlock network0_first;
  std::array<kernels::VnBlock, 2> network0_rest;
  std::array<kernels::VnBlock, 2> network1;
  kernels::PackedMatrix global_direction;
  kernels::PackedMatrix global_fc;
};

struct ModelData {
  Architecture arch;
  std::optional<Calibration> calibration;  // of modes coarse and paper
  std::optional<VerifiedCalibration> verified_calibration;
  double covariance_inflation = 1;

  // Architecture `vnreg`; nothing below belongs to it.
  std::optional<DescriptorModel> descriptor_model;
  std::optional<JudgeModel> judge;

  EncoderData encoder;

  // Local module (paper, section III-B). The encoder of its own is an ablation, as is a module
  // without the invariant layer, whose frame is the identity.
  std::optional<EncoderData> local_encoder;
  std::array<kernels::VnBlock, 2> network2;
  std::array<kernels::VnNormLayer, 2> invariant;
  kernels::PackedMatrix frame;
  kernels::Linear descriptor;

  // Fine register (paper, section III-D).
  std::array<kernels::Linear, 3> significance;
  kernels::PairLayer pair;
  std::array<kernels::Linear, 2> weight;
};

}  // namespace vnreg::detail
