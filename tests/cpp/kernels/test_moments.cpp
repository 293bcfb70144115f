#include "kernels/moments.hpp"

#include <Eigen/Geometry>
#include <array>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

struct Cloud {
  std::vector<float> x, y, z;
  Coordinates view() const { return {x.data(), y.data(), z.data()}; }
};

Cloud random_cloud(Random& random, Index count, float spread) {
  Cloud cloud;
  for (Index i = 0; i < count; ++i) {
    cloud.x.push_back(spread * random.normal());
    cloud.y.push_back(spread * random.normal());
    cloud.z.push_back(0.1f * spread * random.normal());
  }
  return cloud;
}

/// The definition, in float64: offset 3, covariance 6, skew 3.
std::array<double, 12> naive_moments(const Cloud& cloud, Index centre, double radius) {
  double total = 0, first[3] = {}, second[3][3] = {}, third[3] = {};
  for (std::size_t j = 0; j < cloud.x.size(); ++j) {
    const auto c = static_cast<std::size_t>(centre);
    const double d[3] = {double{cloud.x[j]} - double{cloud.x[c]},
                         double{cloud.y[j]} - double{cloud.y[c]},
                         double{cloud.z[j]} - double{cloud.z[c]}};
    const double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (squared >= radius * radius) continue;
    const double root = 1 - squared / (radius * radius);
    const double w = root * root;
    total += w;
    for (int a = 0; a < 3; ++a) {
      first[a] += w * d[a];
      third[a] += w * squared * d[a];
      for (int b = 0; b < 3; ++b) second[a][b] += w * d[a] * d[b];
    }
  }
  std::array<double, 12> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] = first[a] / total / radius;
    out[9 + a] = third[a] / total / (radius * radius * radius);
  }
  std::size_t at = 3;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b) {
      out[at++] = 4 * (second[a][b] / total / (radius * radius) - out[a] * out[b]);
    }
  }
  return out;
}

TEST_CASE("moments equal their definition") {
  Random random(71);
  constexpr float radii[moment_radii] = {0.2f, 0.7f, 3.0f};
  for (const Index count : {1, 2, 3, 15, 16, 17, 31, 33, 64, 333, 1024}) {
    const Cloud cloud = random_cloud(random, count, 0.6f);
    SpatialIndex index(count);
    index.build(cloud.view(), count);
    GuardedFloats bounds(index.leaves());
    for (const Index centre : {Index{0}, count / 2, count - 1}) {
      const auto c = static_cast<std::size_t>(centre);
      const float place[3] = {cloud.x[c], cloud.y[c], cloud.z[c]};
      Moments moments[moment_radii];
      radius_moments(index, place, radii, bounds.data(), moments);
      for (Index r = 0; r < moment_radii; ++r) {
        CAPTURE(count, centre, r);
        const auto expected = naive_moments(cloud, centre, double{radii[r]});
        const Moments& m = moments[r];
        NormalisedError error[3];
        for (std::size_t i = 0; i < 3; ++i) {
          error[0].add(double{m.offset[i]}, expected[i]);
          error[2].add(double{m.skew[i]}, expected[9 + i]);
        }
        for (std::size_t i = 0; i < 6; ++i) {
          error[1].add(double{m.covariance[i]}, expected[3 + i]);
        }
        for (const NormalisedError& e : error) REQUIRE(e.value() < 5e-6);
      }
      REQUIRE(bounds.intact());
    }
  }
}

TEST_CASE("an isolated point has moments of zero and finite features") {
  const Cloud cloud{{0, 5, 9}, {0, 5, 9}, {0, 5, 9}};
  SpatialIndex index(3);
  index.build(cloud.view(), 3);
  float bounds[1];
  constexpr float place[3] = {5, 5, 5};
  constexpr float radii[moment_radii] = {0.25f, 0.5f, 1.0f};
  Moments moments[moment_radii];
  radius_moments(index, place, radii, bounds, moments);
  for (const Moments& m : moments) {
    for (const float v : m.offset) REQUIRE(v == 0.0f);
    for (const float v : m.covariance) REQUIRE(v == 0.0f);
    for (const float v : m.skew) REQUIRE(v == 0.0f);
  }
  MomentFeatures features;
  moment_features(moments, place, features);
  for (const float v : features.scalars) REQUIRE(std::isfinite(v));
  REQUIRE(features.context[0] == Vector3f(5, 5, 5));
}

TEST_CASE("vectors of moments turn with the cloud and scalars stay") {
  Random random(72);
  constexpr Index count = 200;
  const Cloud cloud = random_cloud(random, count, 0.6f);
  const Eigen::Matrix3f turn =
      Eigen::Quaternionf(0.3f, -0.7f, 0.2f, 0.5f).normalized().toRotationMatrix();
  Cloud turned = cloud;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Vector3f p = turn * Vector3f(cloud.x[i], cloud.y[i], cloud.z[i]);
    turned.x[i] = p.x();
    turned.y[i] = p.y();
    turned.z[i] = p.z();
  }
  const auto features_of = [](const Cloud& c) {
    SpatialIndex index(count);
    index.build(c.view(), count);
    std::vector<float> bounds(static_cast<std::size_t>(index.leaves()));
    constexpr float radii[moment_radii] = {0.25f, 0.5f, 1.0f};
    const float place[3] = {c.x[7], c.y[7], c.z[7]};
    Moments moments[moment_radii];
    radius_moments(index, place, radii, bounds.data(), moments);
    MomentFeatures features;
    moment_features(moments, place, features);
    return features;
  };
  const MomentFeatures a = features_of(cloud), b = features_of(turned);
  for (Index i = 0; i < moment_scalars; ++i) {
    CAPTURE(i);
    REQUIRE(std::abs(a.scalars[i] - b.scalars[i]) < 1e-5f);
  }
  for (Index i = 0; i < local_vectors; ++i) {
    REQUIRE((turn * a.local[i] - b.local[i]).norm() < 1e-5f);
  }
  for (Index i = 0; i < context_vectors; ++i) {
    REQUIRE((turn * a.context[i] - b.context[i]).norm() < 1e-5f);
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
