// Neighbourhoods of both clouds, and the edge vectors that the encoder starts from.
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Spatial order, k nearest neighbours and the three edge vectors per point (paper, section III-A):
/// mean_j(x_j) - x_i; x_i; mean_j(x_j) x x_i. Fills cloud.offset_*, spacing_squared,
/// features.edges.
void find_neighbourhoods(const ModelData& model, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
