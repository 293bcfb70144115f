// Neighbourhoods of both clouds, and the edge vectors that the paper's encoder starts from.
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Spatial order and k nearest neighbours. Fills cloud.index, spacing_squared, and for the paper's
/// encoder offset_*.
void find_neighbourhoods(const ModelData& model, Workspace& workspace) noexcept;

/// The three edge vectors per point (paper, section III-A): mean_j(x_j) - x_i; x_i;
/// mean_j(x_j) x x_i. Fills features.edges. Needs find_neighbourhoods() before.
void find_edges(Workspace& workspace) noexcept;

}  // namespace vnreg::detail
