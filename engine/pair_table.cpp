#include "engine/pair_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/workspace.hpp"

namespace vnreg::detail {
namespace {

constexpr int distance_bins = 26;
constexpr int angle_bins = 7;
static_assert(distance_bins * angle_bins * angle_bins * angle_bins == pair_keys);
static_assert(pair_keys < no_pair_key);

// In r.m.s. radii. Closer pairs turn with the noise of their points; farther ones are rare, and
// lost first when the clouds overlap in part.
constexpr float least_distance = 0.75f;
constexpr float most_distance = 2.7f;

inline float absolute(float v) noexcept { return v < 0 ? -v : v; }

/// The bin of an angle from its cosine without sign. The arc cosine is a polynomial (Abramowitz and
/// Stegun 4.4.45, error below 7e-5), so that rows of pairs vectorise.
inline int angle_bin(float cosine) noexcept {
  const float c = absolute(cosine) < 1.0f ? absolute(cosine) : 1.0f;
  const float polynomial = 1.5707288f + c * (-0.2121144f + c * (0.0742610f + c * -0.0187293f));
  const float angle = std::sqrt(1.0f - c) * polynomial;
  const int bin =
      static_cast<int>(angle * (static_cast<float>(angle_bins) * 2 / std::numbers::pi_v<float>));
  return bin < angle_bins - 1 ? bin : angle_bins - 1;
}

inline std::uint16_t key_of(const Surface& s, std::size_t i, std::size_t j) noexcept {
  const float dx = s.x[j] - s.x[i], dy = s.y[j] - s.y[i], dz = s.z[j] - s.z[i];
  const float distance = std::sqrt(dx * dx + dy * dy + dz * dz);
  const bool usable = distance >= least_distance && distance < most_distance;
  const float per_distance = 1.0f / (usable ? distance : 1.0f);
  const float ax = s.normal_x[i], ay = s.normal_y[i], az = s.normal_z[i];
  const float bx = s.normal_x[j], by = s.normal_y[j], bz = s.normal_z[j];
  const int first = angle_bin((ax * dx + ay * dy + az * dz) * per_distance);
  const int second = angle_bin((bx * dx + by * dy + bz * dz) * per_distance);
  const int between = angle_bin(ax * bx + ay * by + az * bz);
  const float place = ((usable ? distance : least_distance) - least_distance) *
                      (distance_bins / (most_distance - least_distance));
  const int bin =
      static_cast<int>(place) < distance_bins ? static_cast<int>(place) : distance_bins - 1;
  const int key = ((bin * angle_bins + first) * angle_bins + second) * angle_bins + between;
  return static_cast<std::uint16_t>(usable ? key : no_pair_key);
}

}  // namespace

std::uint16_t pair_key(const Surface& surface, Index first, Index second) noexcept {
  return key_of(surface, static_cast<std::size_t>(first), static_cast<std::size_t>(second));
}

void fill_pair_table(Workspace& w) noexcept {
  const Surface& target = w.verified.surface[1];
  PairTable& table = w.verified.table;
  const Index n = std::min(table_points, target.count);
  parallel_for(w.threads, n, [&](Index i, int) {
    std::uint16_t* keys = table.keys.data() + i * n;
#pragma omp simd
    for (Index j = 0; j < n; ++j) {
      keys[j] = key_of(target, static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    }
  });
  // Counting sort. While the pairs are put in place, start[key + 1] runs from the start of the
  // key's pairs to their end, which is the start of the next key's.
  std::uint32_t* start = table.start.data();
  std::fill_n(start, pair_keys + 2, 0u);
  for (Index p = 0; p < n * n; ++p) {
    const std::uint16_t key = table.keys[static_cast<std::size_t>(p)];
    if (key != no_pair_key) ++start[key + 2];
  }
  for (std::uint32_t key = 2; key < pair_keys + 2; ++key) start[key] += start[key - 1];
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const std::uint16_t key = table.keys[static_cast<std::size_t>(i * n + j)];
      if (key == no_pair_key) continue;
      table.pairs[start[key + 1]++] = {static_cast<std::uint16_t>(i),
                                       static_cast<std::uint16_t>(j)};
    }
  }
}

}  // namespace vnreg::detail
