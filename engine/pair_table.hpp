// Pairs of surface points, grouped by what a rigid motion leaves unchanged.
#pragma once

#include <limits>

#include "engine/surface.hpp"

namespace vnreg::detail {

/// The key of a pair that is too close or too far apart to fix a pose.
inline constexpr std::uint16_t no_pair_key = std::numeric_limits<std::uint16_t>::max();
/// Keys are below it.
inline constexpr std::uint32_t pair_keys = 26 * 7 * 7 * 7;

/// Bins of the distance between the points and of the three angles, each without its sign, between
/// both normals and the line and between the normals.
std::uint16_t pair_key(const Surface& surface, Index first, Index second) noexcept;

/// verified.table: the ordered pairs of the target's first table_points points, by key.
void fill_pair_table(Workspace& workspace) noexcept;

}  // namespace vnreg::detail
