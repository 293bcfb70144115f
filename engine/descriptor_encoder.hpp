// The network `vnreg` on both clouds side by side (docs/design.md).
#pragma once

#include <cstdint>

#include "engine/cloud.hpp"
#include "engine/descriptor_workspace.hpp"
#include "engine/parallel.hpp"
#include "engine/stage_recorder.hpp"

namespace vnreg::detail {

/// workspace.features[side].out of the clouds `sides`, which are in network coordinates with their
/// indices built. `seed` decides which points are encoded where a cloud has more than the model
/// takes.
void encode_descriptors(const DescriptorModel& model, const Cloud clouds[2], Sides sides,
                        std::uint64_t seed, const Threads& threads, DescriptorWorkspace& workspace,
                        StageRecorder& recorder) noexcept;

}  // namespace vnreg::detail
