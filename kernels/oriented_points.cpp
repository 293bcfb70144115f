#include "kernels/oriented_points.hpp"

#include <algorithm>
#include <type_traits>

// That a packet may alias its floats is an attribute, which template arguments lose.
#pragma GCC diagnostic ignored "-Wignored-attributes"

namespace vnreg::kernels {
namespace {

using Eigen::internal::PacketBlock;
using Eigen::internal::pload;
using Eigen::internal::pstoreu;
using Eigen::internal::ptranspose;

/// The packet of the build, halved where it holds more than a record.
using Lanes = std::conditional_t<(packet_size > oriented_point_size),
                                 Eigen::internal::packet_traits<float>::half, Packet>;
constexpr Index lanes = std::min(packet_size, oriented_point_size);

/// The records of as many points as a packet has lanes.
void gather_block(const float* records, const std::uint16_t* places, float* const out[6],
                  Index first) noexcept {
  for (Index part = 0; part < 6; part += lanes) {
    PacketBlock<Lanes, lanes> block;
    for (Index i = 0; i < lanes; ++i) {
      block.packet[i] = pload<Lanes>(records + oriented_point_size * places[first + i] + part);
    }
    ptranspose(block);
    for (Index k = 0; k < std::min(lanes, 6 - part); ++k) {
      pstoreu(out[part + k] + first, block.packet[k]);
    }
  }
}

}  // namespace

void gather_points(const float* records, const std::uint16_t* places, Index count,
                   const OrientedArrays& out) noexcept {
  float* const arrays[6] = {out.x, out.y, out.z, out.normal_x, out.normal_y, out.normal_z};
  Index i = 0;
  for (; i + lanes <= count; i += lanes) gather_block(records, places, arrays, i);
  for (; i < count; ++i) {
    const float* record = records + oriented_point_size * places[i];
    for (Index k = 0; k < 6; ++k) arrays[k][i] = record[k];
  }
}

}  // namespace vnreg::kernels
