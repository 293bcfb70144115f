#include "kernels/surroundings.hpp"

#include <array>
#include <cmath>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

constexpr float radii[surroundings_radii] = {0.25f, 0.9f};

struct Cloud {
  std::vector<float> x, y, z;
  Coordinates view() const { return {x.data(), y.data(), z.data()}; }
  Index size() const { return static_cast<Index>(x.size()); }
};

Cloud random_cloud(Random& random, Index count) {
  Cloud cloud;
  for (Index i = 0; i < count; ++i) {
    cloud.x.push_back(0.5f * random.normal());
    cloud.y.push_back(0.5f * random.normal());
    cloud.z.push_back(0.1f * random.normal());
  }
  return cloud;
}

/// The definition, in float64: weight, offset 3, covariance 6.
std::array<double, 10> naive(const Cloud& cloud, const std::array<double, 3>& centre,
                             double radius) {
  double total = 0, first[3] = {}, second[3][3] = {};
  for (std::size_t j = 0; j < cloud.x.size(); ++j) {
    const double d[3] = {double{cloud.x[j]} - centre[0], double{cloud.y[j]} - centre[1],
                         double{cloud.z[j]} - centre[2]};
    const double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (squared >= radius * radius) continue;
    const double w = std::pow(1 - squared / (radius * radius), 2);
    total += w;
    for (int a = 0; a < 3; ++a) {
      first[a] += w * d[a];
      for (int b = 0; b < 3; ++b) second[a][b] += w * d[a] * d[b];
    }
  }
  const double below = total + 1e-3;
  std::array<double, 10> out{};
  out[0] = total / static_cast<double>(cloud.x.size());
  for (std::size_t a = 0; a < 3; ++a) out[1 + a] = first[a] / below / radius;
  std::size_t at = 4;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b) {
      out[at++] = 4 * (second[a][b] / below / (radius * radius) - out[1 + a] * out[1 + b]);
    }
  }
  return out;
}

std::array<double, 10> flat(const Surroundings& s) {
  std::array<double, 10> out{double{s.weight}};
  for (std::size_t i = 0; i < 3; ++i) out[1 + i] = double{s.offset[i]};
  for (std::size_t i = 0; i < 6; ++i) out[4 + i] = double{s.covariance[i]};
  return out;
}

TEST_CASE("surroundings equal their definition, on points, between them and far from all") {
  Random random(83);
  for (const Index count : {1, 2, 15, 16, 17, 33, 333, 1024}) {
    const Cloud cloud = random_cloud(random, count);
    SpatialIndex index(count);
    index.build(cloud.view(), count);
    GuardedFloats bounds(index.leaves());
    const auto last = static_cast<std::size_t>(count - 1);
    const std::array<float, 3> places[] = {{cloud.x[last], cloud.y[last], cloud.z[last]},
                                           {0.3f, -0.2f, 0.15f},
                                           {cloud.x[0] + 0.24f, cloud.y[0], cloud.z[0]},
                                           {7.0f, 0.0f, 0.0f}};
    for (const auto& place : places) {
      Surroundings found[surroundings_radii];
      surroundings(index, place.data(), radii, bounds.data(), found);
      for (Index r = 0; r < surroundings_radii; ++r) {
        CAPTURE(count, place[0], r);
        const auto expected =
            naive(cloud, {double{place[0]}, double{place[1]}, double{place[2]}}, double{radii[r]});
        const auto got = flat(found[r]);
        for (std::size_t i = 0; i < 10; ++i) {
          REQUIRE(std::abs(got[i] - expected[i]) <= 2e-5 * std::max(1.0, std::abs(expected[i])));
        }
      }
    }
  }
}

TEST_CASE("where there is nothing, surroundings are zero") {
  Random random(84);
  const Cloud cloud = random_cloud(random, 40);
  SpatialIndex index(40);
  index.build(cloud.view(), 40);
  GuardedFloats bounds(index.leaves());
  const float place[3] = {0, 0, 100};
  Surroundings found[surroundings_radii];
  surroundings(index, place, radii, bounds.data(), found);
  for (const Surroundings& s : found) {
    for (const double value : flat(s)) REQUIRE(value == 0.0);
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
