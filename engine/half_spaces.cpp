#include "engine/half_spaces.hpp"

#include <algorithm>
#include <limits>

namespace vnreg::detail {
namespace {

using Eigen::internal::padd;
using Eigen::internal::pand;
using Eigen::internal::pcmp_lt;
using Eigen::internal::pload;
using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::pmax;
using Eigen::internal::pmin;
using Eigen::internal::pmul;
using Eigen::internal::pset1;
using Eigen::internal::pstore;
using Eigen::internal::pstoreu;
using kernels::packet_size;
using Packet = kernels::Packet;

// Packets of directions whose sums stay in registers.
constexpr Index together = 3;
static_assert(half_space_directions % (together * packet_size) == 0);
constexpr Index points_per_excess = 80;

/// The projections of a point on as many directions, from the k-th on, as a packet has lanes.
struct Lanes {
  Packet x, y, z;

  explicit Lanes(Index k) noexcept
      : x(pload<Packet>(sphere_directions.x + k)),
        y(pload<Packet>(sphere_directions.y + k)),
        z(pload<Packet>(sphere_directions.z + k)) {}

  Packet along(const kernels::Coordinates& points, Index i) const noexcept {
    return pmadd(pset1<Packet>(points.z[i]), z,
                 pmadd(pset1<Packet>(points.y[i]), y, pmul(pset1<Packet>(points.x[i]), x)));
  }
};

}  // namespace

void measure_extents(const kernels::Coordinates& points, Index count, Extents& extents) noexcept {
  constexpr Index most_kept = most_extent_points / points_per_excess + 1;
  const Index excess = count / points_per_excess;
  for (Index k = 0; k < half_space_directions; k += packet_size) {
    const Lanes lanes(k);
    // The largest projections so far, descending.
    Packet largest[most_kept];
    for (Packet& kept : largest) kept = pset1<Packet>(-std::numeric_limits<float>::infinity());
    for (Index i = 0; i < count; ++i) {
      Packet rest = lanes.along(points, i);
      for (Packet& kept : largest) {
        const Packet smaller = pmin(kept, rest);
        kept = pmax(kept, rest);
        rest = smaller;
      }
    }
    pstoreu(extents.data() + k, largest[excess]);
  }
}

HalfSpace most_beyond(const kernels::Coordinates& points, Index count,
                      const Extents& extents) noexcept {
  alignas(64) float beyond[half_space_directions];
  const Packet one = pset1<Packet>(1.0f);
  const Packet zero = pset1<Packet>(0.0f);
  for (Index k = 0; k < half_space_directions; k += together * packet_size) {
    const Lanes lanes[together] = {Lanes(k), Lanes(k + packet_size), Lanes(k + 2 * packet_size)};
    Packet extent[together], sum[together] = {zero, zero, zero};
    for (Index g = 0; g < together; ++g) {
      extent[g] = ploadu<Packet>(extents.data() + k + g * packet_size);
    }
    for (Index i = 0; i < count; ++i) {
      for (Index g = 0; g < together; ++g) {
        const Packet outside = pcmp_lt(extent[g], lanes[g].along(points, i));
        sum[g] = padd(sum[g], pand(outside, one));
      }
    }
    for (Index g = 0; g < together; ++g) pstore(beyond + k + g * packet_size, sum[g]);
  }
  const auto best = std::max_element(beyond, beyond + half_space_directions) - beyond;
  return {sphere_directions.x[best], sphere_directions.y[best], sphere_directions.z[best],
          extents[static_cast<std::size_t>(best)], static_cast<Index>(beyond[best])};
}

}  // namespace vnreg::detail
