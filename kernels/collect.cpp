#include "kernels/collect.hpp"

#include <utility>

namespace vnreg::kernels {
namespace {

using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
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

/// Sets the weights of all points; the indices of those above 0 to `nearby`. Returns their number.
Index find_nearby(const Coordinates& points, Index count, Index self, float radius,
                  CollectScratch& s) noexcept {
  const float x = points.x[self], y = points.y[self], z = points.z[self];
  const float inverse = 1.0f / (radius * radius);
  float* weight = s.weight_of.data();
#pragma omp simd
  for (Index j = 0; j < count; ++j) {
    const float dx = points.x[j] - x, dy = points.y[j] - y, dz = points.z[j] - z;
    const float root = 1.0f - (dx * dx + dy * dy + dz * dz) * inverse;
    weight[j] = root > 0.0f ? root * root : 0.0f;
  }
  Index nearby = 0;
  for (Index j = 0; j < count; ++j) {
    s.nearby[static_cast<std::size_t>(nearby)] = static_cast<std::uint32_t>(j);
    nearby += weight[j] > 0.0f ? 1 : 0;
  }
  float total = 0;
  for (Index n = 0; n < nearby; ++n) total += weight[s.nearby[static_cast<std::size_t>(n)]];
  const float share = 1.0f / total;
  for (Index n = 0; n < nearby; ++n) weight[s.nearby[static_cast<std::size_t>(n)]] *= share;
  return nearby;
}

}  // namespace

CollectScratch::CollectScratch(Index max_points)
    : weight_of(static_cast<std::size_t>(max_points)),
      nearby(static_cast<std::size_t>(max_points) + 1) {}

void collect_rows(const Coordinates& points, Index count, Index self, float radius,
                  const float* rows, Index length, CollectScratch& scratch, float* out) noexcept {
  const Index nearby = find_nearby(points, count, self, radius, scratch);
  constexpr Index block = block_packets * packet_size;
  Index first = 0;
  for (; first + block <= length; first += block) {
    collect_block<block_packets>(scratch, nearby, rows + first, length, out + first);
  }
  for (; first < length; first += packet_size) {
    collect_block<1>(scratch, nearby, rows + first, length, out + first);
  }
}

}  // namespace vnreg::kernels
