#include "kernels/nearest_grid.hpp"

#include <array>
#include <limits>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

using Point = std::array<float, 3>;

enum class Kind { gaussian, plane, line, lattice, equal };

std::vector<Point> make_points(Kind kind, Index count, Random& random) {
  std::vector<Point> points(static_cast<std::size_t>(count));
  for (Point& p : points) {
    for (float& v : p) v = random.normal();
    if (kind == Kind::plane) p[1] = 0.5f;
    if (kind == Kind::line) p = {p[0], 2 * p[0], -p[0]};
    if (kind == Kind::lattice) {
      for (float& v : p) v = std::round(v);  // most distances are tied
    }
    if (kind == Kind::equal) p = {3.0f, -7.0f, 0.25f};
  }
  return points;
}

double distance(const Point& a, const Point& b) {
  double squared = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double d = static_cast<double>(a[axis]) - static_cast<double>(b[axis]);
    squared += d * d;
  }
  return std::sqrt(squared);
}

/// A grid over points, filled slab by slab, upwards or downwards.
class Filled {
 public:
  Filled(const std::vector<Point>& points, float margin, float reach, bool upwards = true)
      : points_(points), index_(static_cast<Index>(points.size())) {
    const auto count = static_cast<Index>(points.size());
    std::vector<float> axes[3];
    for (const Point& p : points) {
      for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].push_back(p[axis]);
    }
    const Coordinates coordinates{axes[0].data(), axes[1].data(), axes[2].data()};
    index_.build(coordinates, count);
    box_ = box_of(coordinates, count);
    for (int axis = 0; axis < 3; ++axis) {
      box_.low[axis] -= margin;
      box_.high[axis] += margin;
    }
    grid_.allocate();
    grid_.place(index_, margin, reach);
    NeighbourScratch scratch(count);
    for (Index slab = 0; slab < grid_.slabs(); ++slab) {
      grid_.fill(index_, upwards ? slab : grid_.slabs() - 1 - slab, scratch);
    }
  }

  std::size_t nearest(const Point& q) const { return grid_.nearest(q[0], q[1], q[2]); }
  const NearestGrid& grid() const { return grid_; }
  double found_distance(const Point& q) const { return distance(q, points_.at(nearest(q))); }
  double nearest_distance(const Point& q) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Point& p : points_) nearest = std::min(nearest, distance(q, p));
    return nearest;
  }
  double cell_diagonal() const { return std::sqrt(3.0) * static_cast<double>(grid_.cell_size()); }

  Point random_query(Random& random) const {
    Point q;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q[axis] = random.uniform(box_.low[axis], box_.high[axis]);
    }
    return q;
  }

 private:
  const std::vector<Point>& points_;
  SpatialIndex index_;
  NearestGrid grid_;
  Box box_;
};

TEST_CASE("a cell's point is at most a diagonal farther than the nearest, within reach") {
  const Kind kind = GENERATE(Kind::gaussian, Kind::plane, Kind::line, Kind::lattice, Kind::equal);
  const Index count = GENERATE(1, 2, 15, 16, 17, 333, 1027);
  const double reach = GENERATE(100.0, 0.4);  // beyond the box; a part of it
  Random random(91);
  const std::vector<Point> points = make_points(kind, count, random);
  const Filled filled(points, 0.5f, static_cast<float>(reach));
  const double diagonal = filled.cell_diagonal();
  double worst_within = -diagonal, worst_beyond = -diagonal;
  for (int i = 0; i < 300; ++i) {
    const Point q = filled.random_query(random);
    const double nearest = filled.nearest_distance(q);
    const double excess = filled.found_distance(q) - nearest;
    // The centre of the cell is at most half a diagonal away.
    double& worst = nearest + diagonal / 2 <= reach ? worst_within : worst_beyond;
    worst = std::max(worst, excess);
  }
  CAPTURE(static_cast<int>(kind), count, reach, diagonal);
  // The sides' cells are counted to within a thousandth of a cell.
  const double rounding = 2e-3 * diagonal;
  REQUIRE(worst_within <= diagonal + rounding);
  // Beyond the reach a block of 4 x 4 x 4 cells shares its point.
  REQUIRE(worst_beyond <= static_cast<double>(NearestGrid::block) * diagonal + rounding);
}

TEST_CASE("slabs may be filled in any order") {
  Random random(92);
  const std::vector<Point> points = make_points(Kind::gaussian, 333, random);
  const Filled upwards(points, 0.3f, 0.5f), downwards(points, 0.3f, 0.5f, false);
  for (int i = 0; i < 500; ++i) {
    const Point q = upwards.random_query(random);
    CAPTURE(q[0], q[1], q[2]);
    REQUIRE(downwards.nearest(q) == upwards.nearest(q));
  }
}

TEST_CASE("many queries are answered like one at a time") {
  Random random(94);
  const std::vector<Point> points = make_points(Kind::gaussian, 333, random);
  const Filled filled(points, 0.3f, 0.5f);
  for (const Index count : {0, 1, 7, 63, 64, 65, 200}) {
    std::vector<float> axes[3];
    for (Index i = 0; i < count; ++i) {
      Point q = filled.random_query(random);
      if (i % 5 == 4) q[static_cast<std::size_t>(i % 3)] *= 100;  // outside of the box
      for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].push_back(q[axis]);
    }
    constexpr std::uint16_t sentinel = 65535;
    std::vector<std::uint16_t> found(static_cast<std::size_t>(count) + 16, sentinel);
    filled.grid().nearest({axes[0].data(), axes[1].data(), axes[2].data()}, count, found.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      CAPTURE(count, i);
      REQUIRE(found[i] == filled.nearest({axes[0][i], axes[1][i], axes[2][i]}));
    }
    REQUIRE(std::all_of(found.begin() + count, found.end(),
                        [](std::uint16_t v) { return v == sentinel; }));
  }
}

TEST_CASE("outside of the box the nearest cell answers, and NaN counts as low") {
  Random random(93);
  const std::vector<Point> points = make_points(Kind::gaussian, 65, random);
  const Filled filled(points, 0.5f, 100.0f);
  const float far = 1e30f;
  for (int i = 0; i < 100; ++i) {
    const Point q = filled.random_query(random);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point low = q, lower = q, high = q, higher = q, nan = q;
      low[axis] = -100;
      lower[axis] = -far;
      high[axis] = 100;
      higher[axis] = far;
      nan[axis] = std::numeric_limits<float>::quiet_NaN();
      CAPTURE(axis, q[0], q[1], q[2]);
      REQUIRE(filled.nearest(lower) == filled.nearest(low));
      REQUIRE(filled.nearest(higher) == filled.nearest(high));
      REQUIRE(filled.nearest(nan) == filled.nearest(low));
      REQUIRE(filled.nearest(high) < points.size());
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
