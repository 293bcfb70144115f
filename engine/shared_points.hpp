// Points that both clouds hold, to the last digits: of a cloud and its crop, of two parts of one
// file, of a copy. Around such a point both clouds are alike to rounding, which independent samples
// of one surface never are. So they are found without a guess of the pose, and tell it exactly,
// also where a symmetric shape would fit nearly as well turned.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/descriptors.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::detail {

/// Fewer may be an accident.
inline constexpr Index least_shared_points = 8;

struct SharedPoints {
  struct Surroundings {
    float size;           // trace of the covariance of the points near
    float shape;          // Frobenius norm
    std::uint16_t point;  // encoded
  };
  std::vector<Surroundings> known;  // of the target, by size
  Index count = 0;                  // pairs of points whose surroundings are the same
  kernels::Floats place[2][3];      // of the pairs' points, per cloud and axis; network coordinates
  kernels::Floats weight;           // 1 for the pairs that the motion tried brings together

  SharedPoints() = default;
  /// For clouds with at most `encoded` described points.
  explicit SharedPoints(Index encoded);
};

/// The pairs of points with the same surroundings.
void find_shared_points(const CloudDescriptors& source, const CloudDescriptors& target,
                        SharedPoints& shared) noexcept;

/// The motion, in network coordinates, that brings most of the pairs together, if there are enough
/// of them to be no accident. `unit`: the larger r.m.s. radius of the clouds.
std::optional<kernels::RigidTransform> shared_motion(double unit, SharedPoints& shared) noexcept;

/// The exact motion of the pairs that `near` brings together; nothing if they are too few.
std::optional<kernels::RigidTransform> shared_motion_near(const kernels::RigidTransform& near,
                                                          double unit,
                                                          SharedPoints& shared) noexcept;

/// How many of the pairs the motion brings together.
Index brought_together(const kernels::RigidTransform& motion, double unit,
                       const SharedPoints& shared) noexcept;

}  // namespace vnreg::detail
