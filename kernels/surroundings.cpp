#include "kernels/surroundings.hpp"

#include "kernels/power_sums.hpp"

namespace vnreg::kernels {
namespace {

constexpr float least_weight = 1e-3f;

Surroundings finish(const PowerSums& s, float radius, Index count) noexcept {
  Surroundings out;
  const float weight = Eigen::internal::predux(s.weight);
  out.weight = weight / static_cast<float>(count);
  const float per_radius = 1.0f / ((weight + least_weight) * radius);
  s.offset(per_radius, out.offset);
  s.covariance(per_radius / radius, out.offset, out.covariance);
  return out;
}

}  // namespace

void surroundings(const SpatialIndex& index, const float centre[3],
                  const float radii[surroundings_radii], float* leaf_bounds,
                  Surroundings out[surroundings_radii]) noexcept {
  index.leaf_bounds(centre[0], centre[1], centre[2], leaf_bounds);
  for (Index i = 0; i < surroundings_radii; ++i) {
    const float squared = radii[i] * radii[i];
    const PowerSums sums = sum_within(index, leaf_bounds, centre, squared, [](auto...) {});
    out[i] = finish(sums, radii[i], index.count());
  }
}

}  // namespace vnreg::kernels
