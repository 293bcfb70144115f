// What mode verified makes of a cloud: points in their tangent planes, with normals.
#include "engine/surface.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

/// In the plane z = 0, moved; every point off it by `noise` times a normal number.
Points plane(std::size_t count, double noise, const Eigen::Isometry3d& motion, Random& random) {
  Points points(count);
  for (auto& p : points) {
    p = {random.uniform(-1, 1), random.uniform(-0.7, 0.7), noise * random.normal()};
  }
  return moved(points, motion);
}

Points sphere(std::size_t count, Random& random) {
  Points points(count);
  for (auto& p : points) {
    Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
    v.normalize();
    p = {v.x(), v.y(), v.z()};
  }
  return points;
}

Eigen::Vector3d normal_of(const detail::Surface& s, std::size_t i) {
  return Eigen::Vector3f(s.normal_x[i], s.normal_y[i], s.normal_z[i]).cast<double>();
}

/// Root mean square of the points' heights over the plane z = 0 that `motion` has moved.
double rms_height(const PreparedPair& pair, const Eigen::Isometry3d& motion) {
  const auto count = static_cast<std::size_t>(pair.surface()[0].count);
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double height = (motion.inverse() * pair.user_point(0, i)).z();
    squares += height * height;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::min(1.0, std::abs(a.dot(b)))) * 180 / std::numbers::pi;
}

TEST_CASE("noise on a plane shrinks by two or more, and is measured") {
  Random random(211);
  for (const double noise : {0.002, 0.01, 0.02}) {
    for (const std::size_t count : {500u, 1500u}) {
      const Eigen::Isometry3d motion = random_motion(random, 3);
      const Points points = plane(count, noise, motion, random);
      const PreparedPair pair(points, points);
      REQUIRE(pair.built());
      CAPTURE(noise, count);
      REQUIRE(rms_height(pair, motion) < noise / 2);
      REQUIRE(static_cast<double>(pair.surface()[0].noise) * pair.unit() ==
              Approx(noise).epsilon(0.2));
    }
  }
}

TEST_CASE("a plane without noise stays where it is, with its normal everywhere") {
  Random random(212);
  const Eigen::Isometry3d motion = random_motion(random, 3);
  const Points points = plane(777, 0, motion, random);
  const PreparedPair pair(points, points);
  REQUIRE(pair.built());
  REQUIRE(rms_height(pair, motion) < 1e-5);
  REQUIRE(static_cast<double>(pair.surface()[0].noise) < 1e-5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d normal = normal_of(pair.surface()[0], i);
    REQUIRE(normal.norm() == Approx(1).margin(1e-5));
    REQUIRE(angle_deg(normal, motion.linear().col(2)) < 0.1);
  }
}

TEST_CASE("the normals of a sphere point to its centre") {
  Random random(213);
  const Points points = sphere(1500, random);
  const PreparedPair pair(points, points);
  REQUIRE(pair.built());
  std::vector<double> angles;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d outward = pair.user_point(0, i).normalized();
    angles.push_back(angle_deg(normal_of(pair.surface()[0], i), outward));
    // What flattening takes off is about half the height of a cap of 14 neighbours: 0.01 on
    // average.
    REQUIRE(pair.user_point(0, i).norm() == Approx(1).margin(0.05));
  }
  std::sort(angles.begin(), angles.end());
  REQUIRE(angles[angles.size() / 2] < 3);
  REQUIRE(angles.back() < 15);
}

TEST_CASE("every prefix of a surface is spread over the cloud") {
  Random random(214);
  for (const std::size_t count : {65u, 1000u, 2048u, 3000u}) {  // more than are used, too
    const Points points = sphere(count, random);
    const PreparedPair pair(points, points);
    const detail::Surface& s = pair.surface()[0];
    REQUIRE(s.count == std::min<detail::Index>(static_cast<detail::Index>(count), 2048));
    for (const std::size_t prefix : {32u, 64u, 65u}) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < prefix; ++i) sum += pair.user_point(0, i);
      CAPTURE(count, prefix);
      // Random points would be off by 1 / sqrt(prefix) on average.
      REQUIRE(sum.norm() / static_cast<double>(prefix) < 0.17);
    }
  }
}

TEST_CASE("a surface's neighbours are the nearest points of the cloud") {
  Random random(215);
  const Points points = plane(333, 0, Eigen::Isometry3d::Identity(), random);
  const PreparedPair pair(points, points);  // flattening leaves the points where they are
  const detail::Surface& s = pair.surface()[0];
  const auto k = static_cast<std::size_t>(detail::surface_neighbours);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<double> all, listed;
    const auto distance = [&](std::size_t j) {
      return (pair.user_point(0, i) - pair.user_point(0, j)).norm();
    };
    for (std::size_t j = 0; j < points.size(); ++j) all.push_back(distance(j));
    for (std::size_t n = 0; n < k; ++n) listed.push_back(distance(s.neighbours[k * i + n]));
    std::sort(all.begin(), all.end());
    std::sort(listed.begin(), listed.end());
    for (std::size_t n = 0; n < k; ++n) REQUIRE(listed[n] == Approx(all[n]).margin(1e-5));
  }
}

TEST_CASE("a line or a point is refused, on either side") {
  Random random(216);
  const Points body = shape(200, random);
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Isometry3d motion = random_motion(random, 1);
    Points line(150);
    for (auto& p : line) p = {random.normal(), 0, 0};
    line = moved(line, motion);
    const Points point(150, {0, 0, 0});
    CAPTURE(trial);
    REQUIRE(PreparedPair(body, body).built());
    for (const Points& flat : {line, point}) {
      REQUIRE(!PreparedPair(flat, body).built());
      REQUIRE(!PreparedPair(body, flat).built());
      REQUIRE(!PreparedPair(flat, flat).built());
    }
    Registrar registrar(shipped_model(), {.threads = 1});
    for (const Points& flat : {line, point}) {
      REQUIRE(registrar.align(flat, body).status == Status::degenerate);
      REQUIRE(registrar.align(body, flat).status == Status::degenerate);
    }
  }
}

}  // namespace
}  // namespace vnreg::test
