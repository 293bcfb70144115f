// How well a pose explains both surfaces, and the matches that it is judged by.
#pragma once

#include <limits>

#include "engine/motion.hpp"
#include "engine/surface.hpp"

namespace vnreg::detail {

enum class Search {
  cell,   // the point of the grid's cell: at most a cell's diagonal farther than the nearest
  exact,  // the nearest of that point's neighbours: nearly always the nearest of all
};

/// Up to 64 moved points of one surface and their nearest points on the other.
struct Matches {
  static constexpr Index capacity = 64;
  Index count;
  alignas(64) float x[capacity], y[capacity], z[capacity];  // moved
  alignas(64) std::uint16_t place[capacity];                // of the nearest, in the other surface
  alignas(64) float nearest_x[capacity], nearest_y[capacity], nearest_z[capacity];
  alignas(64) float normal_x[capacity], normal_y[capacity], normal_z[capacity];  // at the nearest
  alignas(64) float squared[capacity];                                           // distance
  /// 1 where the normals agree, 0 from 60 degrees on.
  alignas(64) float agreement[capacity];
};

/// The matches of points first .. first + count - 1 (at most 64) of `moving`.
void match_points(const Motion& motion, const Surface& moving, Index first, Index count,
                  const Surface& fixed, Search search, Matches& matches) noexcept;

/// How well a pose explains the first `points` points of each surface (fewer if it has fewer).
struct Fit {
  /// Mean of agreement x (k(d / 3 tolerance) + k(d / 0.3 tolerance)) / 2, where d is the distance
  /// of the match and k(u) = (1 - u^2)^2, 0 from u = 1 on; 1 for identical surfaces.
  float agreement = 0;
  /// Share of points farther than 3 tolerances from the other surface.
  float unmatched = 0;
  /// The part of `unmatched` that lies where the other cloud has an end: beyond a plane with nearly
  /// all of the other cloud on its near side. What is cut off contradicts nothing.
  float beyond = 0;

  /// Points that the other cloud should show, and does not, count against a pose. Without them, of
  /// two poses the one with the larger overlap wins, right or wrong. (The factor: best of 0, 0.3,
  /// 0.6, 1, 1.5, 2.5 and 4 on validation shapes; flat from 1 on.)
  float score() const noexcept { return agreement - 1.5f * (unmatched - beyond); }
};

/// Both ways, since a pose that folds one surface into a part of the other explains only one of
/// them: the mean of both. Where the score cannot reach `least`, nothing counts as beyond.
Fit two_sided_fit(const Motion& motion, const Surface surface[2], Index points, float tolerance,
                  Search search, float least = -std::numeric_limits<float>::infinity()) noexcept;

/// How far a point may be from the surface to speak for a pose that is only probed, in spacings.
inline constexpr float probe_tolerance = 2.4f;
/// Up to `probe_points` points of the source: the sum of (1 - squared distance / tolerance^2), 0
/// beyond. Gives up, and returns 0, when the first points promise nothing.
inline constexpr Index probe_points = 40;
float probe(const Motion& motion, const Surface surface[2], float tolerance) noexcept;

}  // namespace vnreg::detail
