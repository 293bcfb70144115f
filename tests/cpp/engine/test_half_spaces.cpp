// Where a cloud ends, and what lies beyond: against plain loops, and on clouds cut in half.
#include "engine/half_spaces.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

using detail::Extents;
using detail::Index;

constexpr auto directions_count = static_cast<std::size_t>(detail::half_space_directions);

/// float32 coordinates as three arrays.
struct Axes {
  std::vector<float> x, y, z;

  explicit Axes(const Points& points) {
    for (const auto& p : points) {
      x.push_back(static_cast<float>(p[0]));
      y.push_back(static_cast<float>(p[1]));
      z.push_back(static_cast<float>(p[2]));
    }
  }
  Index count() const { return static_cast<Index>(x.size()); }
  kernels::Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
};

Extents extents_of(const Points& points) {
  const Axes axes(points);
  Extents extents;
  detail::measure_extents(axes.coordinates(), axes.count(), extents);
  return extents;
}

Index beyond(const Points& points, const Extents& extents) {
  const Axes axes(points);
  return detail::most_beyond(axes.coordinates(), axes.count(), extents).count;
}

/// The extents of a single point are its inner products with the directions.
std::vector<Eigen::Vector3d> directions() {
  const Extents x = extents_of({{1, 0, 0}}), y = extents_of({{0, 1, 0}}),
                z = extents_of({{0, 0, 1}});
  std::vector<Eigen::Vector3d> result;
  for (std::size_t k = 0; k < directions_count; ++k) {
    result.push_back(Eigen::Vector3f(x[k], y[k], z[k]).cast<double>());
  }
  return result;
}

/// The largest number of points that lie farther than the extent by more than `slack`.
Index naive_beyond(const Points& points, const Extents& extents, double slack) {
  const auto d = directions();
  Index largest = 0;
  for (std::size_t k = 0; k < directions_count; ++k) {
    const double limit = static_cast<double>(extents[k]) + slack;
    largest = std::max<Index>(largest, std::count_if(points.begin(), points.end(), [&](auto& p) {
                                return d[k].dot(Eigen::Vector3d(p.data())) > limit;
                              }));
  }
  return largest;
}

TEST_CASE("the directions of half-spaces lie evenly over the sphere") {
  const auto all = directions();
  const double degree = std::numbers::pi / 180;
  for (std::size_t k = 0; k < all.size(); ++k) {
    REQUIRE(all[k].norm() == Approx(1).margin(1e-6));
    for (std::size_t other = 0; other < k; ++other) {
      REQUIRE(all[k].dot(all[other]) < std::cos(15 * degree));
    }
  }
  Random random(201);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d any =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    double nearest = -1;
    for (const Eigen::Vector3d& d : all) nearest = std::max(nearest, any.dot(d));
    REQUIRE(nearest > std::cos(16 * degree));
  }
}

TEST_CASE("few points lie beyond an extent: one in 80") {
  Random random(202);
  const auto all = directions();
  for (const std::size_t count : {1u, 2u, 79u, 80u, 81u, 159u, 160u, 333u, 512u}) {
    const Points points = moved(shape(count, random), random_motion(random, 1));
    const Extents extents = extents_of(points);
    for (std::size_t k = 0; k < all.size(); ++k) {
      std::vector<double> along;
      for (const auto& p : points) along.push_back(all[k].dot(Eigen::Vector3d(p.data())));
      std::sort(along.begin(), along.end(), std::greater<>());
      CAPTURE(count, k);
      REQUIRE(static_cast<double>(extents[k]) == Approx(along[count / 80]).margin(1e-6));
    }
    REQUIRE(beyond(points, extents) == static_cast<Index>(count / 80));
  }
}

TEST_CASE("points beyond are counted as a plain loop counts them") {
  Random random(203);
  for (const std::size_t count : {1u, 7u, 64u, 333u}) {
    const Extents extents = extents_of(shape(200, random));
    const Points points = moved(shape(count, random), random_motion(random, 0.3));
    const Index got = beyond(points, extents);
    CAPTURE(count);
    REQUIRE(got <= naive_beyond(points, extents, -1e-5));
    REQUIRE(got >= naive_beyond(points, extents, 1e-5));
  }
}

TEST_CASE("no points: none beyond; one point: beyond itself when it is farther out") {
  const Extents extents = extents_of({{0.3, -0.2, 0.5}});
  REQUIRE(beyond({}, extents) == 0);
  REQUIRE(beyond({{0.3, -0.2, 0.5}}, extents) == 0);
  REQUIRE(beyond({{0.6, -0.4, 1.0}}, extents) == 1);
  REQUIRE(beyond({{0.6, -0.4, 1.0}, {0.6, -0.4, 1.0}, {0.3, -0.2, 0.5}}, extents) == 2);
}

TEST_CASE("what was cut off lies beyond, whichever way the clouds are turned") {
  Random random(204);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const auto [kept, removed] = cut_in_half(shape(600, random), normal);
    const Eigen::Isometry3d turn = random_motion(random, 0);
    const Extents extents = extents_of(moved(kept, turn));
    const double share = static_cast<double>(beyond(moved(removed, turn), extents)) /
                         static_cast<double>(removed.size());
    CAPTURE(trial, share);
    REQUIRE(share > 0.6);  // the nearest direction is up to 16 degrees off the cut's normal
    // Points that are missing all over the surface are not.
    Points odd, even;
    const Points both = moved(shape(600, random), turn);
    for (std::size_t i = 0; i < both.size(); ++i) (i % 2 == 0 ? even : odd).push_back(both[i]);
    REQUIRE(static_cast<double>(beyond(odd, extents_of(even))) < 0.1 * 300);
  }
}

}  // namespace
}  // namespace vnreg::test
