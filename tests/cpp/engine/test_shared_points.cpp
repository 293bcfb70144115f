// Points that both clouds hold: found by their surroundings, and what they tell of the pose.
#include "engine/shared_points.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

using detail::SharedPoints;

Points shuffled(Points points, Random& random) {
  std::shuffle(points.begin(), points.end(), random.engine());
  return points;
}

/// What six significant digits leave of coordinates.
Points rounded(Points points) {
  for (auto& p : points) {
    for (double& v : p) v = std::round(v * 1e6) / 1e6;
  }
  return points;
}

/// A tube: any turn about z is nearly right, and half a turn about x.
Points tube(std::size_t count, Random& random) {
  Points points(count);
  for (auto& p : points) {
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    p = {0.3 * std::cos(angle), 0.3 * std::sin(angle), random.uniform(-0.5, 0.5)};
  }
  return points;
}

SharedPoints found(PreparedPair& pair) {
  pair.describe();
  SharedPoints shared(shipped_model().data().descriptor_model->arch.encoded);
  const auto& features = pair.workspace().descriptors.features;
  detail::find_shared_points(features[0].out, features[1].out, shared);
  return shared;
}

TEST_CASE("samples of their own share no points") {
  Random random(311);
  for (int trial = 0; trial < 5; ++trial) {
    PreparedPair pair(shape(1024, random), shape(1024, random));
    SharedPoints shared = found(pair);
    CAPTURE(trial, shared.count);
    REQUIRE(shared.count < detail::least_shared_points);
    REQUIRE(!detail::shared_motion(pair.workspace().verified.radius, shared));
  }
}

TEST_CASE("parts of one cloud tell their pose exactly, also of a symmetric one") {
  Random random(312);
  Registrar registrar(shipped_model(), {.threads = 1});
  for (int trial = 0; trial < 10; ++trial) {
    const Points whole = trial % 2 == 0 ? tube(1024, random) : shape(700, random);
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    Points source = cut_in_half(whole, direction).first;
    const Points rest = cut_in_half(whole, direction).second;
    source.insert(source.end(), rest.begin(), rest.begin() + static_cast<int>(rest.size() / 3));
    const Eigen::Isometry3d truth = random_motion(random, 1);
    const Result& result = registrar.align(shuffled(source, random), moved(whole, truth));
    CAPTURE(trial);
    REQUIRE(result.status == Status::ok);
    REQUIRE(result.confidence > 0.9);
    const Eigen::Isometry3d pose = motion_of(result.T_target_source);
    REQUIRE(rotation_error_deg(pose, truth) < 1e-3);
    REQUIRE((pose.translation() - truth.translation()).norm() < 1e-5);
  }
}

TEST_CASE("shared points survive the rounding of a text file") {
  Random random(313);
  const Points whole = tube(900, random);
  const Eigen::Isometry3d truth = random_motion(random, 1);
  PreparedPair pair(rounded(whole), rounded(moved(whole, truth)));
  SharedPoints shared = found(pair);
  const double unit = pair.workspace().verified.radius;
  const auto motion = detail::shared_motion(unit, shared);
  REQUIRE(motion);
  REQUIRE(detail::brought_together(*motion, unit, shared) > 200);
  const Eigen::Isometry3d pose =
      pair.user_motion(detail::to_motion({motion->rotation, motion->translation / unit}));
  REQUIRE(rotation_error_deg(pose, truth) < 1e-2);
}

TEST_CASE("a motion near the shared one leads to it, another does not") {
  Random random(314);
  const Points whole = shape(600, random);
  PreparedPair pair(whole, whole);
  SharedPoints shared = found(pair);
  const double unit = pair.workspace().verified.radius;
  kernels::RigidTransform near;
  near.rotation = Eigen::AngleAxisd(1e-4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto exact = detail::shared_motion_near(near, unit, shared);
  REQUIRE(exact);
  REQUIRE((exact->rotation - Eigen::Matrix3d::Identity()).norm() < 1e-6);
  near.rotation = Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  REQUIRE(!detail::shared_motion_near(near, unit, shared));
}

TEST_CASE("shared points on a line determine no motion") {
  SharedPoints shared(64);
  for (int i = 0; i < 32; ++i) {
    for (auto& side : shared.place) side[0][static_cast<std::size_t>(i)] = 0.1f * float(i);
    ++shared.count;
  }
  REQUIRE(detail::brought_together({}, 1, shared) == 32);
  REQUIRE(!detail::shared_motion(1, shared));
}

TEST_CASE("every point of a lattice is like many others, and no memory overflows") {
  Points lattice;
  for (int i = 0; i < 8 * 8 * 8; ++i) {
    lattice.push_back({0.1 * (i % 8), 0.1 * (i / 8 % 8), 0.1 * (i / 64)});
  }
  Random random(315);
  PreparedPair pair(lattice, moved(lattice, random_motion(random, 1)));
  const SharedPoints shared = found(pair);
  REQUIRE(static_cast<std::size_t>(shared.count) <= shared.weight.size());
}

}  // namespace
}  // namespace vnreg::test
