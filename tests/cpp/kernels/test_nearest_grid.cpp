#include "kernels/nearest_grid.hpp"

#include <limits>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

struct Cloud {
  std::vector<float> x, y, z;

  void add(float px, float py, float pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  Index count() const { return static_cast<Index>(x.size()); }
  Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
  double distance(std::size_t i, const float* q) const {
    return std::hypot(static_cast<double>(x[i] - q[0]), static_cast<double>(y[i] - q[1]),
                      static_cast<double>(z[i] - q[2]));
  }
  double nearest_distance(const float* q) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < x.size(); ++i) nearest = std::min(nearest, distance(i, q));
    return nearest;
  }
};

Cloud ellipsoid(Index count, const float* half_sides, Random& random) {
  Cloud cloud;
  for (Index i = 0; i < count; ++i) {
    const float v[3] = {random.normal(), random.normal(), random.normal()};
    const float norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + 1e-9f;
    cloud.add(half_sides[0] * v[0] / norm, half_sides[1] * v[1] / norm,
              half_sides[2] * v[2] / norm);
  }
  return cloud;
}

struct Grid {
  Grid(const Cloud& cloud, float margin, float reach) : index(cloud.count()) {
    index.build(cloud.coordinates(), cloud.count());
    NeighbourScratch scratch(cloud.count());
    grid.allocate();
    grid.place(index, margin, reach);
    // In two parts, as two threads would do it, and the second part first.
    grid.fill(index, grid.blocks() / 2, grid.blocks(), scratch);
    grid.fill(index, 0, grid.blocks() / 2, scratch);
  }

  SpatialIndex index;
  NearestGrid grid;
};

/// Every query in the box: never more than a cell's diagonal farther than the nearest point, as
/// long as a point is within reach of the cell's centre.
void check_bound(const Cloud& cloud, float margin, float reach, Random& random) {
  const Grid g(cloud, margin, reach);
  const double diagonal = std::sqrt(3.0) * static_cast<double>(g.grid.cell_size());
  const float* axes[3] = {cloud.x.data(), cloud.y.data(), cloud.z.data()};
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    float q[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax_element(axes[axis], axes[axis] + cloud.count());
      q[axis] = random.uniform(*low - margin, *high + margin);
    }
    const std::size_t found = g.grid.nearest(q[0], q[1], q[2]);
    REQUIRE(found < static_cast<std::size_t>(cloud.count()));
    const double nearest = cloud.nearest_distance(q);
    if (nearest > static_cast<double>(reach) - diagonal / 2) continue;
    worst = std::max(worst, (cloud.distance(found, q) - nearest) / diagonal);
  }
  CAPTURE(worst);
  // Cells are laid in float32.
  REQUIRE(worst <= 1.002);
}

TEST_CASE("the grid's point is at most a cell's diagonal farther than the nearest") {
  Random random(91);
  const float round[3] = {0.5f, 0.4f, 0.3f};
  const float thin[3] = {1.0f, 0.02f, 0.1f};
  const float flat[3] = {1.0f, 0.7f, 0.0f};
  const float line[3] = {0.0f, 0.0f, 2.0f};
  for (const float* sides : {round, thin, flat, line}) {
    for (const Index count : {1, 2, 17, 64, 1023}) {
      CAPTURE(sides[0], sides[1], sides[2], count);
      const Cloud cloud = ellipsoid(count, sides, random);
      check_bound(cloud, 0.1f, 100.0f, random);
      check_bound(cloud, 0.3f, 0.2f, random);
    }
  }
}

TEST_CASE("the grid's cells hold the point nearest to their centres") {
  Random random(92);
  const float sides[3] = {0.5f, 0.4f, 0.3f};
  const Cloud cloud = ellipsoid(333, sides, random);
  const float margin = 0.1f;
  const Grid g(cloud, margin, 100.0f);
  const float size = g.grid.cell_size();
  float low[3];
  const float* axes[3] = {cloud.x.data(), cloud.y.data(), cloud.z.data()};
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = *std::min_element(axes[axis], axes[axis] + cloud.count()) - margin;
  }
  for (int i = 0; i < 2000; ++i) {
    float centre[3];
    for (int axis = 0; axis < 3; ++axis) {
      // 20 cells are inside of the box along every side.
      centre[axis] = low[axis] + size * (static_cast<float>(random.integer(0, 16)) + 0.5f);
    }
    const std::size_t found = g.grid.nearest(centre[0], centre[1], centre[2]);
    REQUIRE(cloud.distance(found, centre) <= cloud.nearest_distance(centre) + 1e-6);
  }
}

TEST_CASE("queries outside of the grid, and NaN, get some point") {
  Random random(93);
  const float sides[3] = {0.5f, 0.4f, 0.3f};
  const Cloud cloud = ellipsoid(100, sides, random);
  const Grid g(cloud, 0.1f, 0.1f);
  for (const float far : {-1e30f, -10.0f, 10.0f, 1e30f, std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()}) {
    REQUIRE(g.grid.nearest(far, 0, 0) < 100);
    REQUIRE(g.grid.nearest(0, far, 0) < 100);
    REQUIRE(g.grid.nearest(far, far, far) < 100);
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
