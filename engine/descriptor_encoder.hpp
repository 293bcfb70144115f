// The network `vnreg` on both clouds side by side (docs/design.md).
#pragma once

#include <cstdint>

#include "engine/cloud.hpp"
#include "engine/descriptor_workspace.hpp"
#include "engine/stage_recorder.hpp"

namespace vnreg::detail {

/// workspace.features[side].out of both clouds, which are in network coordinates with their indices
/// built. `seed` decides which points are encoded where a cloud has more than the model takes.
void encode_descriptors(const DescriptorModel& model, const Cloud clouds[2], std::uint64_t seed,
                        int threads, DescriptorWorkspace& workspace,
                        StageRecorder& recorder) noexcept;

}  // namespace vnreg::detail
