// How well a pose explains two surfaces: what must hold for any pair, and for cut and flipped ones.
#include "engine/verify.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

using detail::Fit;
using detail::Motion;
using detail::Search;

constexpr detail::Index all_points = detail::most_surface_points;

Fit fit_of(const PreparedPair& pair, const Eigen::Isometry3d& T_target_source,
           Search search = Search::exact) {
  return detail::two_sided_fit(pair.surface_motion(T_target_source), pair.surface(), all_points,
                               pair.spacing(), search);
}

float contradicted(const Fit& fit) { return fit.unmatched - fit.beyond; }

/// `T_target_source`, after half a turn of the source about an axis through its centroid.
Eigen::Isometry3d flipped(const PreparedPair& pair, const Eigen::Isometry3d& T_target_source,
                          int axis) {
  const Eigen::Vector3d c = pair.centroid(0);
  return T_target_source * Eigen::Translation3d(c) *
         Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(axis)) *
         Eigen::Translation3d(-c);
}

TEST_CASE("identical surfaces explain each other fully at the identity") {
  Random random(221);
  for (const std::size_t count : {65u, 333u, 1024u}) {
    const Points cloud = moved(shape(count, random), random_motion(random, 2));
    const PreparedPair pair(cloud, cloud);
    REQUIRE(pair.built());
    const Fit fit = fit_of(pair, Eigen::Isometry3d::Identity());
    CAPTURE(count);
    // The search may stop beside a point now and then.
    REQUIRE(fit.agreement == Approx(1).margin(3e-3));
    REQUIRE(fit.unmatched == 0);
    REQUIRE(fit.beyond == 0);
    REQUIRE(fit.score() == fit.agreement);
  }
}

TEST_CASE("agreement and shares lie between 0 and 1, whatever the pose") {
  const int seed = GENERATE(range(0, 8));
  Random random(static_cast<std::uint64_t>(222 + seed));
  const PreparedPair pair(shape(100 + 50 * static_cast<std::size_t>(seed), random),
                          shape(333, random));
  REQUIRE(pair.built());
  for (const double reach : {0.0, 0.3, 1.0, 100.0}) {
    for (const Search search : {Search::cell, Search::exact}) {
      const Fit fit = fit_of(pair, random_motion(random, reach), search);
      CAPTURE(reach, fit.agreement, fit.unmatched, fit.beyond);
      REQUIRE((fit.agreement >= 0 && fit.agreement <= 1 + 1e-5f));
      REQUIRE((fit.beyond >= 0 && fit.beyond <= fit.unmatched && fit.unmatched <= 1));
      REQUIRE(fit.agreement <= 1 - fit.unmatched + 1e-5f);  // what has no match agrees with nothing
      if (reach > 50) {
        REQUIRE(fit.unmatched == 1);
        REQUIRE(fit.beyond == 1);  // the whole cloud is off to one side
      }
    }
  }
}

TEST_CASE("swapping the clouds and turning the pose round changes nothing") {
  Random random(231);
  for (int trial = 0; trial < 10; ++trial) {
    const Points source = shape(300, random);
    const Points target = moved(shape(411, random), random_motion(random, 1));
    const Eigen::Isometry3d pose = random_motion(random, 0.5);
    const Fit there = fit_of({source, target}, pose);
    const Fit back = fit_of({target, source}, pose.inverse());
    CAPTURE(trial);
    // A rounding may move a point across the border of a cell, or of a comparison.
    const float one_point = 1.0f / 300;
    REQUIRE(back.agreement == Approx(there.agreement).margin(one_point));
    REQUIRE(back.unmatched == Approx(there.unmatched).margin(one_point));
    REQUIRE(back.beyond == Approx(there.beyond).margin(one_point));
  }
}

TEST_CASE("with half a cloud the right pose is not contradicted; a flip is") {
  Random random(232);
  for (int trial = 0; trial < 10; ++trial) {
    const Points whole = shape(800, random);
    const Eigen::Vector3d normal(random.normal(), random.normal(), random.normal());
    const Points half = cut_in_half(shape(800, random), normal).first;
    const Eigen::Isometry3d truth = random_motion(random, 1);
    for (const bool cut_source : {false, true}) {
      const PreparedPair pair(cut_source ? half : whole, moved(cut_source ? whole : half, truth));
      REQUIRE(pair.built());
      const Fit right = fit_of(pair, truth);
      CAPTURE(trial, cut_source, right.unmatched, right.beyond);
      REQUIRE(right.unmatched > 0.1f);  // of both clouds: half of one of them, less a margin
      REQUIRE(contradicted(right) < 0.2f * right.unmatched);
      for (int axis = 0; axis < 3; ++axis) {
        const Fit wrong = fit_of(pair, flipped(pair, truth, axis));
        CAPTURE(axis, wrong.unmatched, wrong.beyond);
        REQUIRE(contradicted(wrong) > contradicted(right));
        REQUIRE(wrong.score() < right.score());
      }
    }
  }
}

TEST_CASE("the fit falls as the pose leaves the right one") {
  Random random(233);
  const Points source = shape(700, random);
  const Eigen::Isometry3d truth = random_motion(random, 1);
  const PreparedPair pair(source, moved(shape(700, random), truth));
  float previous = 2;
  for (const double degrees : {0.0, 6.0, 15.0, 30.0}) {
    const Eigen::Isometry3d off =
        truth * Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
    const float score = fit_of(pair, off).score();
    CAPTURE(degrees, score);
    REQUIRE(score < previous);
    previous = score;
  }
}

TEST_CASE("exact search finds the nearest point nearly always, and never one behind the cell's") {
  Random random(234);
  const Points source = shape(500, random);
  const PreparedPair pair(source, shape(600, random));
  const detail::Surface& target = pair.surface()[1];
  const Motion motion = pair.surface_motion(random_motion(random, 0.02));
  int misses = 0;
  for (detail::Index first = 0; first < 500; first += 63) {  // the last block is smaller
    detail::Matches exact, cell;
    const detail::Index count = std::min<detail::Index>(63, 500 - first);
    detail::match_points(motion, pair.surface()[0], first, count, target, Search::exact, exact);
    detail::match_points(motion, pair.surface()[0], first, count, target, Search::cell, cell);
    REQUIRE(exact.count == count);
    for (detail::Index i = 0; i < count; ++i) {
      float nearest = std::numeric_limits<float>::infinity();
      for (std::size_t j = 0; j < static_cast<std::size_t>(target.count); ++j) {
        const float dx = exact.x[i] - target.x[j], dy = exact.y[i] - target.y[j],
                    dz = exact.z[i] - target.z[j];
        nearest = std::min(nearest, dx * dx + dy * dy + dz * dz);
      }
      // Distances that are equal to within 1e-6 are not told apart.
      REQUIRE(exact.squared[i] <= cell.squared[i] * 1.00001f);
      REQUIRE(exact.squared[i] >= nearest * (1 - 1e-5f) - 1e-9f);
      misses += exact.squared[i] > nearest * 1.0001f + 1e-8f ? 1 : 0;
    }
  }
  REQUIRE(misses < 25);  // of 500
}

TEST_CASE("a probe counts the points near the other surface, and gives up on a pose far off") {
  Random random(235);
  const Points cloud = shape(600, random);
  const PreparedPair pair(cloud, cloud);
  const float tolerance = detail::probe_tolerance * pair.spacing();
  const auto probed = [&](const Eigen::Isometry3d& pose) {
    return detail::probe(pair.surface_motion(pose), pair.surface(), tolerance);
  };
  const auto most = static_cast<float>(detail::probe_points);
  const float right = probed(Eigen::Isometry3d::Identity());
  REQUIRE(right > 0.7f * most);
  REQUIRE(right <= most);
  Eigen::Isometry3d away = Eigen::Isometry3d::Identity();
  away.translation() = Eigen::Vector3d(50, 0, 0);
  REQUIRE(probed(away) == 0);
}

}  // namespace
}  // namespace vnreg::test
