// Two clouds up to where mode verified starts: network coordinates, descriptors, surfaces.
#pragma once

#include <algorithm>
#include <utility>

#include "clouds.hpp"
#include "engine/cloud.hpp"
#include "engine/descriptor_encoder.hpp"
#include "engine/neighbourhood.hpp"
#include "engine/surface.hpp"
#include "engine/workspace.hpp"

namespace vnreg::test {

/// The built-in model, read once.
inline const Model& shipped_model() {
  static const Model model = Model::builtin();
  return model;
}

/// Whatever the points: what the engine refuses before it makes surfaces comes this far here.
class PreparedPair {
 public:
  PreparedPair(const Points& source, const Points& target, int threads = 1)
      : workspace_(
            shipped_model().data(), {.mode = Mode::verified, .threads = threads},
            static_cast<detail::Index>(std::max({source.size(), target.size(), std::size_t{64}}))) {
    detail::Cloud* cloud = workspace_.cloud;
    detail::gather(source, {.min_points = 1}, workspace_.deadline, cloud[0]);
    detail::gather(target, {.min_points = 1}, workspace_.deadline, cloud[1]);
    const double radius = std::max(cloud[0].rms_radius, cloud[1].rms_radius);
    if (radius > 0) scale_ = radius / shipped_model().data().arch.rms_radius;
    workspace_.verified.radius = radius / scale_;
    for (int side = 0; side < 2; ++side) detail::normalize(scale_, cloud[side]);
    detail::find_neighbourhoods(shipped_model().data(), workspace_);
    built_ = detail::build_surfaces(workspace_);
  }

  void describe() {
    detail::encode_descriptors(*shipped_model().data().descriptor_model, workspace_.cloud,
                               detail::both_sides, 0, workspace_.threads, workspace_.descriptors,
                               workspace_.recorder);
  }

  bool built() const { return built_; }
  detail::Workspace& workspace() { return workspace_; }
  detail::Surface* surface() { return workspace_.verified.surface; }
  const detail::Surface* surface() const { return workspace_.verified.surface; }
  float spacing() const { return workspace_.verified.spacing; }

  /// The surfaces' unit of length, in that of the input.
  double unit() const { return scale_ * workspace_.verified.radius; }

  Eigen::Vector3d centroid(std::size_t side) const {
    return Eigen::Map<const Eigen::Vector3d>(workspace_.cloud[side].centroid);
  }

  /// Where the i-th point of a surface lies in the input's coordinates.
  Eigen::Vector3d user_point(std::size_t side, std::size_t i) const {
    const detail::Surface& s = surface()[side];
    return centroid(side) + unit() * Eigen::Vector3f(s.x[i], s.y[i], s.z[i]).cast<double>();
  }

  /// The motion of the surfaces that is T_target_source of the input.
  detail::Motion surface_motion(const Eigen::Isometry3d& T_target_source) const {
    return detail::to_motion(
        {T_target_source.linear(), (T_target_source * centroid(0) - centroid(1)) / unit()});
  }

  /// T_target_source of the input, of a motion of the surfaces.
  Eigen::Isometry3d user_motion(const detail::Motion& motion) const {
    using Rotation = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    result.linear() = Eigen::Map<const Rotation>(motion.rotation).cast<double>();
    result.translation() =
        centroid(1) +
        unit() * Eigen::Map<const Eigen::Vector3f>(motion.translation).cast<double>() -
        result.linear() * centroid(0);
    return result;
  }

 private:
  detail::Workspace workspace_;
  double scale_ = 1;
  bool built_ = false;
};

/// The points on the side of the plane through the centroid that `normal` points away from, and the
/// points beyond it: about half each.
inline std::pair<Points, Points> cut_in_half(const Points& points, const Eigen::Vector3d& normal) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += Eigen::Vector3d(p.data());
  const Eigen::Vector3d centroid = sum / static_cast<double>(points.size());
  std::pair<Points, Points> halves;
  for (const auto& p : points) {
    const bool beyond = normal.dot(Eigen::Vector3d(p.data()) - centroid) > 0;
    (beyond ? halves.second : halves.first).push_back(p);
  }
  return halves;
}

}  // namespace vnreg::test
