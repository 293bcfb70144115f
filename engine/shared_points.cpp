#include "engine/shared_points.hpp"

#include <algorithm>
#include <cmath>

#include "engine/counter_hash.hpp"

namespace vnreg::detail {
namespace {

using kernels::Coordinates;
using kernels::RigidTransform;

// Relative difference of what is called the same: room for coordinates with six digits. Of a
// quarter million pairs of points from independent samples, 0.01 differ by so little in both.
constexpr float same = 1e-4f;
// A regular object repeats itself: so many partners of a point are kept.
constexpr Index most_partners = 4;
constexpr int tries = 24;
constexpr double most_apart = 2e-3;  // r.m.s. radii
// Three points nearer to a line than this tell no turn about it; of the larger singular value.
constexpr double least_width = 1e-3;

SharedPoints::Surroundings surroundings_of(const CloudDescriptors& cloud, Index point) noexcept {
  const float* c = cloud.covariance.data() + 6 * point;
  const float squares = c[0] * c[0] + c[3] * c[3] + c[5] * c[5];
  const float mixed = c[1] * c[1] + c[2] * c[2] + c[4] * c[4];
  return {c[0] + c[3] + c[5], std::sqrt(squares + 2 * mixed), static_cast<std::uint16_t>(point)};
}

bool smaller(const SharedPoints::Surroundings& a, const SharedPoints::Surroundings& b) noexcept {
  return a.size != b.size ? a.size < b.size : a.point < b.point;
}

void write_place(const CloudDescriptors& cloud, std::size_t point, std::size_t pair,
                 kernels::Floats (&place)[3]) noexcept {
  place[0][pair] = cloud.x[point];
  place[1][pair] = cloud.y[point];
  place[2][pair] = cloud.z[point];
}

/// Pairs a source point with the target points of the same surroundings, the first of them.
void pair_up(const CloudDescriptors& source, Index point, const CloudDescriptors& target,
             SharedPoints& s) noexcept {
  const SharedPoints::Surroundings here = surroundings_of(source, point);
  if (!(here.size > 0)) return;  // nothing near
  SharedPoints::Surroundings least = here;
  least.size *= 1 - same;
  least.point = 0;
  Index partners = 0;
  for (auto there = std::lower_bound(s.known.begin(), s.known.end(), least, smaller);
       there != s.known.end() && there->size <= here.size * (1 + same); ++there) {
    if (std::abs(there->shape - here.shape) > same * here.shape) continue;
    const auto pair = static_cast<std::size_t>(s.count++);
    write_place(source, here.point, pair, s.place[0]);
    write_place(target, there->point, pair, s.place[1]);
    if (++partners == most_partners) return;
  }
}

Coordinates places(const SharedPoints& s, std::size_t side) noexcept {
  return {s.place[side][0].data(), s.place[side][1].data(), s.place[side][2].data()};
}

/// Whether the motion brings the points of a pair together.
bool meet(const RigidTransform& motion, double unit, std::size_t pair,
          const SharedPoints& s) noexcept {
  const auto place = [&](std::size_t side) -> Eigen::Vector3d {
    const auto& axes = s.place[side];
    return Eigen::Vector3f(axes[0][pair], axes[1][pair], axes[2][pair]).cast<double>();
  };
  return (motion.rotation * place(0) + motion.translation - place(1)).norm() <= most_apart * unit;
}

/// The motion of the pairs that have a weight; nothing if they lie on a line.
std::optional<RigidTransform> motion_of_weighted(const SharedPoints& s) noexcept {
  const kernels::ProcrustesSolution fit =
      kernels::procrustes(places(s, 0), places(s, 1), s.weight.data(), s.count);
  if (!(fit.singular_values(1) > least_width * fit.singular_values(0))) return std::nullopt;
  return fit.transform;
}

/// The motion of three pairs, chosen by `number`.
std::optional<RigidTransform> motion_of_three(std::uint64_t number, SharedPoints& s) noexcept {
  std::fill_n(s.weight.begin(), s.count, 0.0f);
  for (std::uint64_t k = 0; k < 3; ++k) {
    s.weight[counter_hash(number, k) % static_cast<std::uint64_t>(s.count)] = 1;
  }
  return motion_of_weighted(s);
}

}  // namespace

SharedPoints::SharedPoints(Index encoded) {
  const auto most = static_cast<std::size_t>(most_partners * encoded);
  known.reserve(static_cast<std::size_t>(encoded));
  for (auto& side : place) {
    for (kernels::Floats& axis : side) axis.resize(most);
  }
  weight.resize(most);
}

void find_shared_points(const CloudDescriptors& source, const CloudDescriptors& target,
                        SharedPoints& s) noexcept {
  s.known.clear();
  for (Index i = 0; i < target.count; ++i) s.known.push_back(surroundings_of(target, i));
  std::sort(s.known.begin(), s.known.end(), smaller);
  s.count = 0;
  for (Index i = 0; i < source.count; ++i) pair_up(source, i, target, s);
}

Index brought_together(const RigidTransform& motion, double unit, const SharedPoints& s) noexcept {
  Index count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count); ++i) {
    count += meet(motion, unit, i, s) ? 1 : 0;
  }
  return count;
}

std::optional<RigidTransform> shared_motion(double unit, SharedPoints& s) noexcept {
  if (s.count < least_shared_points) return std::nullopt;
  std::optional<RigidTransform> best;
  Index most = least_shared_points - 1;
  for (std::uint64_t i = 0; i < tries; ++i) {
    const std::optional<RigidTransform> motion = motion_of_three(i, s);
    if (!motion) continue;
    const Index count = brought_together(*motion, unit, s);
    if (count <= most) continue;
    most = count;
    best = motion;
  }
  return best ? shared_motion_near(*best, unit, s) : std::nullopt;
}

std::optional<RigidTransform> shared_motion_near(const RigidTransform& near, double unit,
                                                 SharedPoints& s) noexcept {
  Index count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count); ++i) {
    const bool together = meet(near, unit, i, s);
    s.weight[i] = together ? 1.0f : 0.0f;
    count += together ? 1 : 0;
  }
  return count < least_shared_points ? std::nullopt : motion_of_weighted(s);
}

}  // namespace vnreg::detail
