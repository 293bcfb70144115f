#include "kernels/collect.hpp"

#include <algorithm>
#include <utility>

namespace vnreg::kernels {
namespace {

using Eigen::internal::pload;
using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::predux_max;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;

// Sums of this many packets stay in registers.
constexpr Index block_packets = 8;

/// Sum of weight times Packets packets from `rows`, over the nearby points.
template <Index Packets>
void collect_block(const CollectScratch& s, Index nearby, const float* rows, Index length,
                   float* out) noexcept {
  Packet sum[Packets];
  for (Index i = 0; i < Packets; ++i) sum[i] = pset1<Packet>(0.0f);
  for (Index n = 0; n < nearby; ++n) {
    const auto point = s.nearby[static_cast<std::size_t>(n)];
    const Packet weight = pset1<Packet>(s.weight_of[point]);
    const float* row = rows + static_cast<Index>(point) * length;
    for (Index i = 0; i < Packets; ++i) {
      sum[i] = pmadd(weight, ploadu<Packet>(row + i * packet_size), sum[i]);
    }
  }
  for (Index i = 0; i < Packets; ++i) pstoreu(out + i * packet_size, sum[i]);
}

/// The last packets of a row, fewer than block_packets: picks the block of exactly that width.
template <std::size_t... Width>
void collect_last(const CollectScratch& s, Index nearby, const float* rows, Index length,
                  Index packets, float* out, std::index_sequence<Width...>) noexcept {
  (void)((packets == Index{Width} + 1 &&
          (collect_block<Index{Width} + 1>(s, nearby, rows, length, out), true)) ||
         ...);
}

/// The indices of the positive ones of `count` numbers, of which none is negative; zeros follow the
/// last up to a whole packet.
Index list_positive(const float* values, Index count, std::uint32_t* indices) noexcept {
  Index found = 0;
  for (Index first = 0; first < count; first += packet_size) {
    // Points that are near in space are near in memory: most packets are all zero.
    if (predux_max(pload<Packet>(values + first)) == 0.0f) continue;
    for (Index i = 0; i < packet_size; ++i) {
      indices[found] = static_cast<std::uint32_t>(first + i);
      found += values[first + i] > 0.0f ? 1 : 0;
    }
  }
  return found;
}

/// Sets the weights of all points; the indices of those above 0 to `nearby`. Returns their number.
Index find_nearby(const Coordinates& points, Index count, Index self, float radius,
                  CollectScratch& s) noexcept {
  using Array = Eigen::Map<const Eigen::ArrayXf>;
  const Array x(points.x, count), y(points.y, count), z(points.z, count);
  const auto squared =
      (x - points.x[self]).square() + (y - points.y[self]).square() + (z - points.z[self]).square();
  float* weight = s.weight_of.data();
  Eigen::Map<Eigen::ArrayXf, Eigen::AlignedMax> weights(weight, count);
  weights = (1.0f - squared * (1.0f / (radius * radius))).max(0.0f).square();
  std::fill(weight + count, weight + padded(count), 0.0f);
  const Index nearby = list_positive(weight, count, s.nearby.data());
  weights *= 1.0f / weights.sum();
  return nearby;
}

}  // namespace

CollectScratch::CollectScratch(Index max_points)
    : weight_of(static_cast<std::size_t>(padded(max_points))),
      nearby(static_cast<std::size_t>(padded(max_points)) + 1) {}

void collect_rows(const Coordinates& points, Index count, Index self, float radius,
                  const float* rows, Index length, CollectScratch& scratch, float* out) noexcept {
  const Index nearby = find_nearby(points, count, self, radius, scratch);
  constexpr Index block = block_packets * packet_size;
  Index first = 0;
  for (; first + block <= length; first += block) {
    collect_block<block_packets>(scratch, nearby, rows + first, length, out + first);
  }
  collect_last(scratch, nearby, rows + first, length, (length - first) / packet_size, out + first,
               std::make_index_sequence<static_cast<std::size_t>(block_packets - 1)>{});
}

}  // namespace vnreg::kernels
