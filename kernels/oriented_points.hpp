// Points with normals, gathered by their places in a list.
//
// A point's six numbers lie in one record of 32 bytes, so that a match touches one cache line;
// blocks of records are transposed in registers into one array per number.
#pragma once

#include <cstdint>

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Floats per record: x, y, z, normal x, y, z, and two that are never read.
inline constexpr Index oriented_point_size = 8;

/// Where gathered points go: an array each.
struct OrientedArrays {
  float *x, *y, *z;
  float *normal_x, *normal_y, *normal_z;
};

/// out.x[i] ... = the record places[i], for i < count. `records` is aligned for packets.
void gather_points(const float* records, const std::uint16_t* places, Index count,
                   const OrientedArrays& out) noexcept;

}  // namespace vnreg::kernels
