#include "engine/verify.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

namespace vnreg::detail {
namespace {

// A hypothesis that is right leaves a part of the points without a match where the clouds overlap
// in part, but not most of the first 16.
constexpr Index first_probes = 16;
constexpr float first_probes_least = 4.0f;
// A part of the score goes to points that coincide. Where both clouds hold the same points, it
// tells their pose from one that folds the surface onto another part of itself; where they are
// samples of their own, no pose gets it.
constexpr float coincidence_share = 0.5f;
constexpr float coincidence_tolerance = 0.1f;  // of the other tolerance
// The rest is for points in the plane of their match, to within this part of the other tolerance:
// samples of one surface do not coincide, but they lie on each other's planes. (Validation shapes,
// 75 % kept: recall 78 % without this factor, 82 to 83 % with 1, 0.7 and 0.5 of the tolerance.)
constexpr float plane_tolerance = 0.7f;

/// The nearest of a point's neighbours, the point itself included; of those that are equally near
/// to within 1e-6 of the squared distance, the first.
std::uint16_t step(const Surface& s, std::uint16_t from, float x, float y, float z) noexcept {
  const float* px = s.neighbour_places.data() + 3 * neighbour_lanes * Index{from};
  const float* py = px + neighbour_lanes;
  const float* pz = py + neighbour_lanes;
  // The lane takes the last bits of the distance: numbers from 0 on are ordered like their bits.
  constexpr std::int32_t lane_bits = neighbour_lanes - 1;
  std::int32_t least = std::numeric_limits<std::int32_t>::max();
#pragma omp simd reduction(min : least)
  for (std::int32_t n = 0; n < neighbour_lanes; ++n) {
    const float dx = px[n] - x, dy = py[n] - y, dz = pz[n] - z;
    const auto bits = std::bit_cast<std::int32_t>(dx * dx + dy * dy + dz * dz);
    const std::int32_t key = (bits & ~lane_bits) | n;
    least = key < least ? key : least;
  }
  return s
      .neighbours[static_cast<std::size_t>(surface_neighbours * Index{from} + (least & lane_bits))];
}

void move(const Motion& m, const Surface& s, Index first, Matches& out) noexcept {
  const float* x = s.x.data() + first;
  const float* y = s.y.data() + first;
  const float* z = s.z.data() + first;
  const float* r = m.rotation;
  const float* t = m.translation;
#pragma omp simd
  for (Index i = 0; i < out.count; ++i) {
    out.x[i] = r[0] * x[i] + r[1] * y[i] + r[2] * z[i] + t[0];
    out.y[i] = r[3] * x[i] + r[4] * y[i] + r[5] * z[i] + t[1];
    out.z[i] = r[6] * x[i] + r[7] * y[i] + r[8] * z[i] + t[2];
  }
}

/// Sets the nearest points, and their normals, of the moved ones.
void find_nearest(const Surface& fixed, Search search, Matches& out) noexcept {
  fixed.grid.nearest({out.x, out.y, out.z}, out.count, out.place);
  if (search == Search::exact) {
    for (Index i = 0; i < out.count; ++i) {
      out.place[i] = step(fixed, out.place[i], out.x[i], out.y[i], out.z[i]);
    }
  }
  kernels::gather_points(
      fixed.records.data(), out.place, out.count,
      {out.nearest_x, out.nearest_y, out.nearest_z, out.normal_x, out.normal_y, out.normal_z});
}

void compare(const Motion& m, const Surface& s, Index first, Matches& out) noexcept {
  const float* nx = s.normal_x.data() + first;
  const float* ny = s.normal_y.data() + first;
  const float* nz = s.normal_z.data() + first;
  const float* r = m.rotation;
#pragma omp simd
  for (Index i = 0; i < out.count; ++i) {
    const float dx = out.x[i] - out.nearest_x[i];
    const float dy = out.y[i] - out.nearest_y[i];
    const float dz = out.z[i] - out.nearest_z[i];
    out.squared[i] = dx * dx + dy * dy + dz * dz;
    const float cosine = (r[0] * nx[i] + r[1] * ny[i] + r[2] * nz[i]) * out.normal_x[i] +
                         (r[3] * nx[i] + r[4] * ny[i] + r[5] * nz[i]) * out.normal_y[i] +
                         (r[6] * nx[i] + r[7] * ny[i] + r[8] * nz[i]) * out.normal_z[i];
    const float agreement = 2 * (cosine < 0 ? -cosine : cosine) - 1;
    out.agreement[i] = agreement > 0 ? agreement : 0;
  }
}

using Numbers = Eigen::Map<const Eigen::ArrayXf, Eigen::Aligned64>;

/// Biweight: from 1 at 0 to 0 at 1 and beyond.
template <class Squared>
auto kernel(const Squared& squared) noexcept {
  return (1 - squared).max(0.0f).square();
}

/// Moved points without a match.
struct Unmatched {
  Index count = 0;
  alignas(64) float x[most_surface_points], y[most_surface_points], z[most_surface_points];

  void add(const Matches& m, float limit_squared) noexcept {
    for (Index i = 0; i < m.count; ++i) {
      // Written always, kept if unmatched: no branch that the data decides.
      x[count] = m.x[i];
      y[count] = m.y[i];
      z[count] = m.z[i];
      count += m.squared[i] > limit_squared ? 1 : 0;
    }
  }
};

float sum_of_agreement(const Matches& m, float tolerance) noexcept {
  const float per_limit = 1 / (9 * tolerance * tolerance);
  const float per_coincidence = per_limit / (coincidence_tolerance * coincidence_tolerance);
  const float per_plane = 1 / (plane_tolerance * plane_tolerance * tolerance * tolerance);
  const auto of = [&](const float* numbers) { return Numbers(numbers, m.count); };
  const auto height = (of(m.x) - of(m.nearest_x)) * of(m.normal_x) +
                      (of(m.y) - of(m.nearest_y)) * of(m.normal_y) +
                      (of(m.z) - of(m.nearest_z)) * of(m.normal_z);
  const auto near = kernel(of(m.squared) * per_limit) * kernel(height.square() * per_plane);
  const auto coincident = kernel(of(m.squared) * per_coincidence);
  return (((1 - coincidence_share) * near + coincidence_share * coincident) * of(m.agreement))
      .sum();
}

/// Sum of 1 - squared distance / tolerance^2, no less than 0, over source points.
float sum_of_nearness(const Motion& motion, const Surface surface[2], Index first, Index count,
                      float tolerance, Matches& m) noexcept {
  m.count = count;
  move(motion, surface[0], first, m);
  find_nearest(surface[1], Search::cell, m);
  const auto of = [&](const float* numbers) { return Numbers(numbers, count); };
  const auto squared = (of(m.x) - of(m.nearest_x)).square() + (of(m.y) - of(m.nearest_y)).square() +
                       (of(m.z) - of(m.nearest_z)).square();
  return (1 - squared * (1 / (tolerance * tolerance))).max(0.0f).sum();
}

/// How well the first points of `moving` lie on `fixed`, and those without a match.
struct OneSidedFit {
  float per_point;
  float agreement = 0;
  Unmatched unmatched;

  OneSidedFit(const Motion& motion, const Surface& moving, const Surface& fixed, Index points,
              float tolerance, Search search) noexcept {
    const Index total = std::min(points, moving.count);
    per_point = 1 / static_cast<float>(total);
    Matches matches;
    for (Index first = 0; first < total; first += Matches::capacity) {
      match_points(motion, moving, first, std::min(Matches::capacity, total - first), fixed, search,
                   matches);
      agreement += sum_of_agreement(matches, tolerance);
      unmatched.add(matches, 9 * tolerance * tolerance);
    }
    agreement *= per_point;
  }

  float unmatched_share() const noexcept { return static_cast<float>(unmatched.count) * per_point; }
  float beyond_share(const Extents& extents) const noexcept {
    const HalfSpace most =
        most_beyond({unmatched.x, unmatched.y, unmatched.z}, unmatched.count, extents);
    return static_cast<float>(most.count) * per_point;
  }
};

}  // namespace

void match_points(const Motion& motion, const Surface& moving, Index first, Index count,
                  const Surface& fixed, Search search, Matches& out) noexcept {
  out.count = count;
  move(motion, moving, first, out);
  find_nearest(fixed, search, out);
  compare(motion, moving, first, out);
}

Fit two_sided_fit(const Motion& motion, const Surface surface[2], Index points, float tolerance,
                  Search search, float least) noexcept {
  const OneSidedFit a(motion, surface[0], surface[1], points, tolerance, search);
  const OneSidedFit b(inverse(motion), surface[1], surface[0], points, tolerance, search);
  Fit fit{(a.agreement + b.agreement) / 2, (a.unmatched_share() + b.unmatched_share()) / 2, 0};
  if (fit.agreement < least) return fit;
  fit.beyond = (a.beyond_share(surface[1].extents) + b.beyond_share(surface[0].extents)) / 2;
  return fit;
}

float probe(const Motion& motion, const Surface surface[2], float tolerance) noexcept {
  static_assert(probe_points <= Matches::capacity);
  const Index total = std::min(probe_points, surface[0].count);
  const Index first = std::min(first_probes, total);
  Matches matches;
  const float sum = sum_of_nearness(motion, surface, 0, first, tolerance, matches);
  if (sum < first_probes_least) return 0;
  return sum + sum_of_nearness(motion, surface, first, total - first, tolerance, matches);
}

}  // namespace vnreg::detail
