// The SE(3)-equivariant network of the paper, on both clouds side by side.
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Edge vectors, networks 0 and 1 and the global head (paper, section III-A): features.latent and
/// features.global.
void encode_global(const ModelData& model, Workspace& workspace) noexcept;

/// Network 2, invariant layer, descriptors and significances (paper, sections III-B and III-D):
/// features.descriptors and features.significance. Needs encode_global() before.
void encode_local(const ModelData& model, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
