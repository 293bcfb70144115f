// The SIMD packet of the build and the padding that it asks for.
//
// Every feature buffer of the kernels is a column-major matrix whose rows (channels) are padded to
// whole packets. Padding rows of weights are zero, so padding rows of features stay zero through
// every layer and no kernel needs a row tail.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace vnreg::kernels {

using Index = std::ptrdiff_t;
using Packet = Eigen::internal::packet_traits<float>::type;

inline constexpr Index packet_size = Eigen::internal::packet_traits<float>::size;

/// The smallest multiple of the packet size that holds `rows`.
constexpr Index padded(Index rows) noexcept {
  return (rows + packet_size - 1) / packet_size * packet_size;
}

/// Floats whose first element is aligned for packets.
using Floats = std::vector<float, Eigen::aligned_allocator<float>>;

using RowMajorMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace vnreg::kernels
