#include "kernels/collect.hpp"

#include <algorithm>
#include <limits>

#include "kernels/list_within.hpp"

namespace vnreg::kernels {
namespace {

using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::pmul;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;

// Packets of the four sums that stay in registers.
constexpr Index block_packets = 2;
// Lists end with zeros up to a multiple of this: what for_each_within() asks for.
constexpr Index list_chunk = 16;

constexpr Index whole_chunks(Index count) noexcept {
  return (count + list_chunk - 1) / list_chunk * list_chunk;
}

/// Lists the points within the radius of the tile's box. Returns their number.
Index find_candidates(const Coordinates& points, Index count, const Box& box, float limit,
                      CollectScratch& s) noexcept {
  using Numbers = Eigen::Map<const Eigen::ArrayXf>;
  const auto outside = [&](const float* q, int axis) {
    return (box.low[axis] - Numbers(q, count)).max(Numbers(q, count) - box.high[axis]).max(0.0f);
  };
  float* squared = s.least.data();
  Eigen::Map<Eigen::ArrayXf>(squared, count) =
      outside(points.x, 0).square() + outside(points.y, 1).square() + outside(points.z, 2).square();
  std::fill(squared + count, squared + whole_chunks(count), std::numeric_limits<float>::infinity());
  std::size_t found = 0;
  for_each_within(squared, whole_chunks(count), limit, [&](Index j) {
    s.candidates[found] = static_cast<std::uint32_t>(j);
    s.x[found] = points.x[j];
    s.y[found] = points.y[j];
    s.z[found] = points.z[j];
    ++found;
  });
  return static_cast<Index>(found);
}

/// Squared distances of the candidates from each point of the group, and the least of each.
void measure(const Coordinates& points, const Index group[collect_group], Index candidates,
             CollectScratch& s) noexcept {
  const float *x = s.x.data(), *y = s.y.data(), *z = s.z.data();
  float* least = s.least.data();
  std::fill_n(least, whole_chunks(candidates), std::numeric_limits<float>::infinity());
  for (Index g = 0; g < collect_group; ++g) {
    const float cx = points.x[group[g]], cy = points.y[group[g]], cz = points.z[group[g]];
    float* squared = s.squared[g].data();
#pragma omp simd
    for (Index c = 0; c < candidates; ++c) {
      const float dx = x[c] - cx, dy = y[c] - cy, dz = z[c] - cz;
      const float distance = dx * dx + dy * dy + dz * dz;
      squared[c] = distance;
      least[c] = distance < least[c] ? distance : least[c];
    }
  }
}

/// Lists the candidates near to a point of the group, with their weights for all of them; zeros
/// follow up to a multiple of four. Returns the number listed.
Index list_nearby(Index candidates, float limit, CollectScratch& s) noexcept {
  float* weights = s.weights.data();
  Index found = 0;
  for_each_within(s.least.data(), whole_chunks(candidates), limit, [&](Index c) {
    s.nearby[static_cast<std::size_t>(found)] = s.candidates[static_cast<std::size_t>(c)];
    for (Index g = 0; g < collect_group; ++g) {
      weights[found * collect_group + g] = s.squared[g][static_cast<std::size_t>(c)];
    }
    ++found;
  });
  Eigen::Map<Eigen::ArrayXf> all(weights, found * collect_group);
  all = (1.0f - all * (1.0f / limit)).max(0.0f).square();
  for (; found % collect_group != 0; ++found) {
    s.nearby[static_cast<std::size_t>(found)] = 0;
    std::fill_n(weights + found * collect_group, collect_group, 0.0f);
  }
  return found;
}

/// 1 / the sum of each point's weights.
void measure_shares(const float* weights, Index nearby, float shares[collect_group]) noexcept {
  constexpr Index lanes = collect_group * collect_group;
  float sums[lanes] = {};
  for (Index i = 0; i < nearby * collect_group; i += lanes) {
    for (Index lane = 0; lane < lanes; ++lane) sums[lane] += weights[i + lane];
  }
  for (Index g = 0; g < collect_group; ++g) {
    float sum = 0;
    for (Index lane = g; lane < lanes; lane += collect_group) sum += sums[lane];
    shares[g] = 1.0f / sum;
  }
}

/// `Packets` packets of the sums of the first `points` of the group.
template <Index Packets>
void collect_block(const CollectScratch& s, Index nearby, const float* rows, Index length,
                   const float shares[collect_group], Index points, float* out) noexcept {
  Packet sum[collect_group][Packets];
  for (auto& sums : sum) {
    for (Packet& packet : sums) packet = pset1<Packet>(0.0f);
  }
  const float* weight = s.weights.data();
  for (Index n = 0; n < nearby; ++n, weight += collect_group) {
    const float* row = rows + static_cast<Index>(s.nearby[static_cast<std::size_t>(n)]) * length;
    for (Index i = 0; i < Packets; ++i) {
      const Packet value = ploadu<Packet>(row + i * packet_size);
      for (Index g = 0; g < collect_group; ++g) {
        sum[g][i] = pmadd(pset1<Packet>(weight[g]), value, sum[g][i]);
      }
    }
  }
  for (Index g = 0; g < points; ++g) {
    for (Index i = 0; i < Packets; ++i) {
      pstoreu(out + g * length + i * packet_size, pmul(pset1<Packet>(shares[g]), sum[g][i]));
    }
  }
}

}  // namespace

CollectScratch::CollectScratch(Index max_points)
    : candidates(static_cast<std::size_t>(max_points)),
      // Room for the zeros behind the last.
      nearby(static_cast<std::size_t>(max_points + collect_group)),
      weights(static_cast<std::size_t>((max_points + collect_group) * collect_group)) {
  for (Floats* numbers : {&x, &y, &z, &least}) {
    numbers->resize(static_cast<std::size_t>(whole_chunks(max_points)));
  }
  for (Floats& numbers : squared) numbers.resize(static_cast<std::size_t>(max_points));
}

void collect_rows(const Coordinates& points, Index count, Index first, Index width, float radius,
                  const float* rows, Index length, CollectScratch& s, float* out) noexcept {
  const float limit = radius * radius;
  const Box box = box_of({points.x + first, points.y + first, points.z + first}, width);
  const Index candidates = find_candidates(points, count, box, limit, s);
  for (Index p = 0; p < width; p += collect_group, out += collect_group * length) {
    // The last group may repeat a point.
    Index group[collect_group];
    for (Index g = 0; g < collect_group; ++g) group[g] = first + std::min(p + g, width - 1);
    measure(points, group, candidates, s);
    const Index nearby = list_nearby(candidates, limit, s);
    float shares[collect_group];
    measure_shares(s.weights.data(), nearby, shares);
    const Index own = std::min(collect_group, width - p);
    Index i = 0;
    for (; i + block_packets * packet_size <= length; i += block_packets * packet_size) {
      collect_block<block_packets>(s, nearby, rows + i, length, shares, own, out + i);
    }
    if (i < length) collect_block<1>(s, nearby, rows + i, length, shares, own, out + i);
  }
}

}  // namespace vnreg::kernels
