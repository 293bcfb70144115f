#include "engine/residual.hpp"

#include <algorithm>
#include <cmath>

#include "engine/rigid.hpp"

namespace vnreg::detail {
namespace {

using kernels::RigidTransform;

constexpr Index points_per_task = 256;

Index task_count(const Cloud& cloud) noexcept {
  return (cloud.count + points_per_task - 1) / points_per_task;
}

/// Lower median of the distances to the nearest other point.
double median_spacing(const Cloud& cloud, Floats& buffer) noexcept {
  float* squared = buffer.data();
  std::copy_n(cloud.spacing_squared.data(), cloud.count, squared);
  float* middle = squared + (cloud.count - 1) / 2;
  std::nth_element(squared, middle, squared + cloud.count);
  return std::sqrt(static_cast<double>(*middle));
}

/// residual.squared[side][i]: squared distance from point i of the cloud (in its spatial order),
/// moved onto the other cloud, to the nearest point there.
void find_nearest(const RigidTransform motions[2], Workspace& w) noexcept {
  ResidualBuffers& r = w.residual;
  const Index source_tasks = task_count(w.cloud[0]);
  parallel_for(w.threads, source_tasks + task_count(w.cloud[1]), [&](Index i, int thread) {
    const Index side = i < source_tasks ? 0 : 1;
    const Cloud& cloud = w.cloud[side];
    const Index first = (i - side * source_tasks) * points_per_task;
    const Index count = std::min(points_per_task, cloud.count - first);
    const kernels::Coordinates ordered = cloud.index.ordered();
    float* x = r.moved_x[side].data() + first;
    float* y = r.moved_y[side].data() + first;
    float* z = r.moved_z[side].data() + first;
    move_points(motions[side], {ordered.x + first, ordered.y + first, ordered.z + first}, count, x,
                y, z);
    kernels::nearest_distances(w.cloud[1 - side].index, {x, y, z}, count,
                               w.scratch[static_cast<std::size_t>(thread)].neighbours,
                               r.squared[side].data() + first);
  });
}

}  // namespace

Residual measure_residual(const kernels::RigidTransform& pose, Workspace& w) noexcept {
  const RigidTransform motions[2] = {pose, inverse(pose)};
  find_nearest(motions, w);
  Residual result;
  result.inlier_distance = 2 * std::max(median_spacing(w.cloud[0], w.residual.spacing),
                                        median_spacing(w.cloud[1], w.residual.spacing));
  const double limit = result.inlier_distance * result.inlier_distance;
  double squares = 0;
  Index inliers = 0;
  for (Index side = 0; side < 2; ++side) {
    for (Index i = 0; i < w.cloud[side].count; ++i) {
      const auto squared = static_cast<double>(w.residual.squared[side][i]);
      if (squared > limit) continue;
      squares += squared;
      ++inliers;
    }
  }
  const Index points = w.cloud[0].count + w.cloud[1].count;
  result.overlap = static_cast<double>(inliers) / static_cast<double>(points);
  result.rmse = inliers > 0 ? std::sqrt(squares / static_cast<double>(inliers)) : 0.0;
  return result;
}

}  // namespace vnreg::detail
