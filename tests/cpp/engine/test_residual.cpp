// Overlap, r.m.s. error and confidence against their definitions, from the pose in the user's
// units.
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

double nearest(const Eigen::Vector3d& p, const Points& cloud, std::size_t skip) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i != skip) best = std::min(best, (Eigen::Vector3d(cloud[i].data()) - p).norm());
  }
  return best;
}

double median_spacing(const Points& cloud) {
  std::vector<double> spacing;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    spacing.push_back(nearest(Eigen::Vector3d(cloud[i].data()), cloud, i));
  }
  std::sort(spacing.begin(), spacing.end());
  return spacing[(spacing.size() - 1) / 2];
}

TEST_CASE("overlap and r.m.s. error equal their definitions") {
  Random random(51);
  Registrar registrar(random_model().build(), {.mode = Mode::paper});
  constexpr std::size_t none = std::size_t(-1);
  for (int trial = 0; trial < 5; ++trial) {
    const Points source = moved(shape(200, random), random_motion(random, 1), 7);
    const Points target = moved(shape(333, random), random_motion(random, 1), 7);
    const Result& r = registrar.align(source, target);
    REQUIRE(r.has_pose);
    const double limit = 2 * std::max(median_spacing(source), median_spacing(target));
    REQUIRE(r.inlier_distance == Approx(limit).epsilon(1e-5));
    const Points source_moved = moved(source, motion_of(r.T_target_source));
    double squares = 0;
    double inliers = 0;
    double borderline = 0;
    const auto count = [&](const Points& from, const Points& to) {
      for (const auto& p : from) {
        const double d = nearest(Eigen::Vector3d(p.data()), to, none);
        if (std::abs(d - limit) < 1e-5 * limit) ++borderline;
        if (d > limit) continue;
        squares += d * d;
        ++inliers;
      }
    };
    count(source_moved, target);
    count(target, source_moved);
    REQUIRE(r.overlap > 0);
    REQUIRE(r.overlap < 1);
    REQUIRE(std::abs(r.overlap * 533 - inliers) <= borderline + 1e-9);
    REQUIRE(r.rmse == Approx(std::sqrt(squares / inliers)).epsilon(1e-3));
  }
}

ModelDraft calibrated(double bias, double overlap, double residual) {
  ModelDraft draft = random_model();
  draft.metadata["calibration.bias"] = bias;
  draft.metadata["calibration.overlap"] = overlap;
  draft.metadata["calibration.residual"] = residual;
  return draft;
}

TEST_CASE("confidence follows the calibration; below one half the status says so") {
  Random random(52);
  const Points source = shape(200, random);
  const Points target = moved(shape(200, random), random_motion(random, 1));
  Registrar plain(random_model().build(), {.mode = Mode::paper});
  REQUIRE(std::isnan(plain.align(source, target).confidence));
  for (const double bias : {-1000.0, -2.0, 0.0, 2.0, 1000.0}) {
    Registrar registrar(calibrated(bias, 3.5, -1.25).build(), {.mode = Mode::paper});
    const Result& r = registrar.align(source, target);
    const double logit = bias + 3.5 * r.overlap - 1.25 * r.rmse / r.inlier_distance;
    CAPTURE(bias, logit);
    REQUIRE(r.has_pose);
    REQUIRE(r.confidence == Approx(1 / (1 + std::exp(-logit))).margin(1e-9));
    REQUIRE(r.status == (logit < 0 ? Status::low_confidence : Status::ok));
  }
}

TEST_CASE("coinciding points give a residual of 0, not NaN") {
  Registrar registrar(calibrated(1, 1, 1).build(), {.mode = Mode::paper});
  Random random(53);
  Points cloud = shape(20, random);
  for (int i = 0; i < 2; ++i) cloud.insert(cloud.end(), cloud.begin(), cloud.end());
  const Result& r = registrar.align(cloud, cloud);
  REQUIRE(r.inlier_distance == 0);
  REQUIRE(std::isfinite(r.confidence));
}

}  // namespace
}  // namespace vnreg::test
