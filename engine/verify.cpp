#include "engine/verify.hpp"

#include <algorithm>

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

/// The nearest of a point's neighbours, the point itself included.
std::uint16_t step(const Surface& s, std::uint16_t from, float x, float y, float z) noexcept {
  const std::uint16_t* neighbours =
      s.neighbours.data() + surface_neighbours * static_cast<Index>(from);
  float squared[surface_neighbours];
#pragma omp simd
  for (Index n = 0; n < surface_neighbours; ++n) {
    const std::size_t at = neighbours[n];
    const float dx = s.x[at] - x, dy = s.y[at] - y, dz = s.z[at] - z;
    squared[n] = dx * dx + dy * dy + dz * dz;
  }
  return neighbours[std::min_element(squared, squared + surface_neighbours) - squared];
}

std::uint16_t nearest(const Surface& s, Search search, float x, float y, float z) noexcept {
  const std::uint16_t at = s.grid.nearest(x, y, z);
  return search == Search::cell ? at : step(s, at, x, y, z);
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

/// Biweight: from 1 at 0 to 0 at 1 and beyond.
inline float kernel(float squared) noexcept {
  const float inside = 1 - squared;
  const float positive = inside > 0 ? inside : 0;
  return positive * positive;
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
  float sum = 0;
#pragma omp simd reduction(+ : sum)
  for (Index i = 0; i < m.count; ++i) {
    const float height = (m.x[i] - m.nearest_x[i]) * m.normal_x[i] +
                         (m.y[i] - m.nearest_y[i]) * m.normal_y[i] +
                         (m.z[i] - m.nearest_z[i]) * m.normal_z[i];
    const float near = kernel(m.squared[i] * per_limit) * kernel(height * height * per_plane);
    const float coincident = kernel(m.squared[i] * per_coincidence);
    sum += ((1 - coincidence_share) * near + coincidence_share * coincident) * m.agreement[i];
  }
  return sum;
}

/// Of the first points of `moving`.
Fit one_sided_fit(const Motion& motion, const Surface& moving, const Surface& fixed, Index points,
                  float tolerance, Search search) noexcept {
  const Index total = std::min(points, moving.count);
  const float limit = 9 * tolerance * tolerance;
  Matches matches;
  Unmatched unmatched;
  Fit fit;
  for (Index first = 0; first < total; first += Matches::capacity) {
    match_points(motion, moving, first, std::min(Matches::capacity, total - first), fixed, search,
                 matches);
    fit.agreement += sum_of_agreement(matches, tolerance);
    unmatched.add(matches, limit);
  }
  const float per_point = 1 / static_cast<float>(total);
  fit.agreement *= per_point;
  fit.unmatched = static_cast<float>(unmatched.count) * per_point;
  fit.beyond = static_cast<float>(count_beyond({unmatched.x, unmatched.y, unmatched.z},
                                               unmatched.count, fixed.extents)) *
               per_point;
  return fit;
}

}  // namespace

void match_points(const Motion& motion, const Surface& moving, Index first, Index count,
                  const Surface& fixed, Search search, Matches& out) noexcept {
  out.count = count;
  move(motion, moving, first, out);
  for (Index i = 0; i < count; ++i) {
    const std::size_t at = nearest(fixed, search, out.x[i], out.y[i], out.z[i]);
    out.nearest_x[i] = fixed.x[at];
    out.nearest_y[i] = fixed.y[at];
    out.nearest_z[i] = fixed.z[at];
    out.normal_x[i] = fixed.normal_x[at];
    out.normal_y[i] = fixed.normal_y[at];
    out.normal_z[i] = fixed.normal_z[at];
  }
  compare(motion, moving, first, out);
}

Fit two_sided_fit(const Motion& motion, const Surface surface[2], Index points, float tolerance,
                  Search search) noexcept {
  const Fit a = one_sided_fit(motion, surface[0], surface[1], points, tolerance, search);
  const Fit b = one_sided_fit(inverse(motion), surface[1], surface[0], points, tolerance, search);
  return {(a.agreement + b.agreement) / 2, (a.unmatched + b.unmatched) / 2,
          (a.beyond + b.beyond) / 2};
}

float probe(const Motion& motion, const Surface surface[2], float tolerance) noexcept {
  const Surface& source = surface[0];
  const Surface& target = surface[1];
  const float* r = motion.rotation;
  const float* t = motion.translation;
  const float per_limit = 1 / (tolerance * tolerance);
  const auto total = static_cast<std::size_t>(std::min(probe_points, source.count));
  float sum = 0;
  for (std::size_t i = 0; i < total; ++i) {
    const float px = source.x[i], py = source.y[i], pz = source.z[i];
    const float x = r[0] * px + r[1] * py + r[2] * pz + t[0];
    const float y = r[3] * px + r[4] * py + r[5] * pz + t[1];
    const float z = r[6] * px + r[7] * py + r[8] * pz + t[2];
    const std::size_t at = target.grid.nearest(x, y, z);
    const float dx = x - target.x[at], dy = y - target.y[at], dz = z - target.z[at];
    const float inside = 1 - (dx * dx + dy * dy + dz * dz) * per_limit;
    sum += inside > 0 ? inside : 0;
    if (i + 1 == static_cast<std::size_t>(first_probes) && sum < first_probes_least) return 0;
  }
  return sum;
}

}  // namespace vnreg::detail
