// The shipped network's descriptors propose motions near the right one.
#include "engine/match_hypotheses.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

std::vector<detail::Motion> proposed(PreparedPair& pair) {
  pair.describe();
  const detail::Index count = detail::propose_from_matches(pair.workspace());
  REQUIRE((count >= 0 && count <= detail::most_match_hypotheses));
  const auto& all = pair.workspace().verified.match.motions;
  return {all.begin(), all.begin() + count};
}

bool same_bits(const std::vector<detail::Motion>& a, const std::vector<detail::Motion>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
}

double best_error_deg(const PreparedPair& pair, const std::vector<detail::Motion>& motions,
                      const Eigen::Isometry3d& truth) {
  double best = 180;
  for (const detail::Motion& motion : motions) {
    best = std::min(best, rotation_error_deg(pair.user_motion(motion), truth));
  }
  return best;
}

/// How far from where `truth` brings the source's centroid the nearest of the motions within
/// `degrees` of it brings it.
double offset_of_near(const PreparedPair& pair, const std::vector<detail::Motion>& motions,
                      const Eigen::Isometry3d& truth, double degrees) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const detail::Motion& motion : motions) {
    const Eigen::Isometry3d pose = pair.user_motion(motion);
    if (rotation_error_deg(pose, truth) > degrees) continue;
    nearest = std::min(nearest, (pose * pair.centroid(0) - truth * pair.centroid(0)).norm());
  }
  return nearest;
}

TEST_CASE("of a moved copy, a match proposes the motion") {
  Random random(241);
  for (const std::size_t count : {65u, 333u, 1024u}) {
    for (const double reach : {0.5, 50.0}) {
      const Points source = shape(count, random);
      const Eigen::Isometry3d truth = random_motion(random, reach);
      Points target = moved(source, truth);
      std::shuffle(target.begin(), target.end(), random.engine());
      PreparedPair pair(source, target);
      const auto motions = proposed(pair);
      CAPTURE(count, reach, motions.size());
      REQUIRE(best_error_deg(pair, motions, truth) < 15);
      REQUIRE(offset_of_near(pair, motions, truth, 15) < 0.1);
    }
  }
}

TEST_CASE("of another sample and of half of it, too") {
  Random random(242);
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::Isometry3d truth = random_motion(random, 1);
    const Points source = shape(800, random), other = shape(800, random);
    const Eigen::Vector3d normal(random.normal(), random.normal(), random.normal());
    for (const Points& part : {other, cut_in_half(other, normal).first}) {
      PreparedPair pair(source, moved(part, truth));
      CAPTURE(trial, part.size());
      const auto motions = proposed(pair);
      REQUIRE(best_error_deg(pair, motions, truth) < 15);
      REQUIRE(offset_of_near(pair, motions, truth, 15) < 0.05);
    }
  }
}

TEST_CASE("all proposed motions are rigid") {
  Random random(243);
  PreparedPair pair(shape(400, random), moved(shape(300, random), random_motion(random, 1)));
  const auto motions = proposed(pair);
  REQUIRE(!motions.empty());
  for (const detail::Motion& motion : motions) {
    const Eigen::Matrix3d r = pair.user_motion(motion).linear();
    REQUIRE((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-5);
    REQUIRE(r.determinant() > 0);
    for (const float t : motion.translation) REQUIRE(std::isfinite(t));
  }
}

TEST_CASE("the same clouds propose the same motions, with any number of threads") {
  Random random(244);
  const Points source = shape(500, random);
  const Points target = moved(shape(411, random), random_motion(random, 1));
  PreparedPair one(source, target);
  const auto expected = proposed(one);
  REQUIRE(!expected.empty());
  REQUIRE(same_bits(proposed(one), expected));  // once more, in used memory
  for (const int threads : {2, 3}) {
    PreparedPair several(source, target, threads);
    CAPTURE(threads);
    REQUIRE(same_bits(proposed(several), expected));
  }
}

}  // namespace
}  // namespace vnreg::test
