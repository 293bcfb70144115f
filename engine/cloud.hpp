// From the user's points to network coordinates: checks, subsampling, common scale, neighbourhoods.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/architecture.hpp"
#include "engine/deadline.hpp"
#include "kernels/neighbours.hpp"
#include "kernels/spatial_index.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

/// One cloud of the pair, with memory for `max_points` points.
struct Cloud {
  struct Candidate {
    std::uint64_t hash;
    std::uint64_t index;
    friend bool operator<(const Candidate& a, const Candidate& b) noexcept {
      return a.hash != b.hash ? a.hash < b.hash : a.index < b.index;
    }
  };

  Cloud() = default;
  explicit Cloud(Index max_points);

  kernels::Coordinates coordinates() const noexcept { return {x.data(), y.data(), z.data()}; }

  Index max_points = 0;
  std::vector<Candidate> candidates;  // of the subsampling

  Index count = 0;          // points used
  std::size_t dropped = 0;  // points left out because a coordinate was not usable
  std::vector<double> xyz;  // the user's coordinates of the points used
  double centroid[3] = {0, 0, 0};
  double rms_radius = 0;

  kernels::Floats x, y, z;  // network coordinates
  kernels::SpatialIndex index;
  kernels::Floats offset_x, offset_y, offset_z;  // mean of x_j - x_i over the k nearest points j
  kernels::Floats spacing_squared;               // to the nearest other point
};

/// How points are taken from a user's cloud.
struct Gathering {
  Index min_points = 0;
  std::uint64_t seed = 0;
  bool drop_non_finite = false;
};

/// Checks the points, takes at most max_points of them, and finds centroid and r.m.s. radius. The
/// answer means nothing if the deadline passes meanwhile.
Status gather(const PointsView& points, const Gathering& how, Deadline& deadline,
              Cloud& cloud) noexcept;

/// Network coordinates: float32((p - centroid) / scale). False if they leave the range in which
/// squared distances are finite (only possible when the model takes coordinates as given).
bool normalize(double scale, Cloud& cloud) noexcept;

}  // namespace vnreg::detail
