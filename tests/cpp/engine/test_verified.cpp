// Mode verified from end to end, with the shipped model.
#include "engine/verified.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

/// Without the `share` of the points that lies farthest along a random direction.
Points cropped(Points points, double share, Random& random) {
  const Eigen::Vector3d normal(random.normal(), random.normal(), random.normal());
  const auto along = [&](const auto& p) { return normal.dot(Eigen::Vector3d(p.data())); };
  std::sort(points.begin(), points.end(),
            [&](const auto& a, const auto& b) { return along(a) < along(b); });
  const double kept = (1 - share) * static_cast<double>(points.size());
  points.resize(static_cast<std::size_t>(kept));
  std::shuffle(points.begin(), points.end(), random.engine());
  return points;
}

Points noisy(Points points, double deviation, Random& random) {
  for (auto& p : points) {
    for (double& v : p) v += deviation * random.normal();
  }
  return points;
}

void require_near(const Pose& pose, const Eigen::Isometry3d& truth) {
  const Eigen::Isometry3d got = motion_of(pose);
  REQUIRE(rotation_error_deg(got, truth) < 5);
  REQUIRE((got.translation() - truth.translation()).norm() < 0.05);
}

/// Which of the box's four symmetries is within 5 degrees: 0 for `truth`, 1 to 3 for half a turn
/// about an axis; -1 for none.
int symmetry_of(const Pose& pose, const Eigen::Isometry3d& truth) {
  for (int which = 0; which < 4; ++which) {
    Eigen::Isometry3d symmetric = truth;
    if (which > 0) {
      symmetric.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(which - 1)));
    }
    if (rotation_error_deg(motion_of(pose), symmetric) < 5) return which;
  }
  return -1;
}

TEST_CASE("verified finds the pose of samples of their own, of parts and under noise") {
  Random random(251);
  Registrar registrar(shipped_model(), {.threads = 1});
  for (int trial = 0; trial < 5; ++trial) {
    const Points source = shape(1000, random), other = shape(911, random);
    const Eigen::Isometry3d truth = random_motion(random, 1);
    const std::pair<const char*, Points> targets[] = {
        {"another sample", other},
        {"a part", cropped(other, 0.3, random)},
        {"noise", noisy(other, 0.01, random)},
        {"a part of the same points", cropped(source, 0.4, random)},
    };
    for (const auto& [name, target] : targets) {
      CAPTURE(trial, name);
      const Result& result = registrar.align(source, moved(target, truth));
      REQUIRE(result.has_pose);
      require_near(result.T_target_source, truth);
    }
  }
}

TEST_CASE("of a symmetric box it says that the pose is ambiguous, and another of the poses") {
  Random random(252);
  Registrar registrar(shipped_model(), {.threads = 1});
  for (int trial = 0; trial < 3; ++trial) {
    const Points source = box(150, random);
    const Eigen::Isometry3d truth = random_motion(random, 1);
    // In an order of its own: else the same points are encoded, and tell the one pose from the
    // others.
    Points target = moved(source, truth);
    std::shuffle(target.begin(), target.end(), random.engine());
    const Result& result = registrar.align(source, target);
    CAPTURE(trial);
    REQUIRE(result.status == Status::ambiguous);
    REQUIRE(!result.alternatives.empty());
    const int best = symmetry_of(result.T_target_source, truth);
    const int second = symmetry_of(result.alternatives[0].T_target_source, truth);
    CAPTURE(best, second);
    REQUIRE(best >= 0);
    REQUIRE(second >= 0);
    REQUIRE(second != best);
  }
}

TEST_CASE("ambiguous is a second pose that scores nearly as much as the first") {
  detail::VerifiedPoses poses;
  REQUIRE(!detail::ambiguous(poses));
  poses.count = 1;
  poses.pose[0].score = 0.8;
  REQUIRE(!detail::ambiguous(poses));
  poses.count = 2;
  poses.pose[1].score = 0.7;
  REQUIRE(!detail::ambiguous(poses));
  poses.pose[1].score = 0.79;
  REQUIRE(detail::ambiguous(poses));
}

TEST_CASE("alternatives are the lesser poses: sorted, far from each other, at most 4 less") {
  Random random(253);
  Registrar registrar(shipped_model(), {.threads = 1});
  for (int trial = 0; trial < 3; ++trial) {
    const Points source = box(100, random);
    const Result& result =
        registrar.align(source, moved(box(120, random), random_motion(random, 1)));
    REQUIRE(result.has_pose);
    double previous = result.score;
    std::vector<Pose> known{result.T_target_source};
    for (const Alternative& alternative : result.alternatives) {
      CAPTURE(trial, alternative.score);
      REQUIRE(alternative.score <= previous);
      REQUIRE(alternative.score >= result.score - 4.0);
      const Eigen::Isometry3d pose = motion_of(alternative.T_target_source);
      for (const Pose& other : known) {
        const Eigen::Isometry3d before = motion_of(other);
        const Eigen::Vector3d apart =
            (pose * Eigen::Vector3d::Zero()) - (before * Eigen::Vector3d::Zero());
        // 0.1 r.m.s. radii; the box's is about 0.5, and its centroid near the origin.
        REQUIRE((rotation_error_deg(pose, before) > 14.9 || apart.norm() > 0.03));
      }
      known.push_back(alternative.T_target_source);
      previous = alternative.score;
    }
  }
}

TEST_CASE("swapping the clouds gives the inverse pose") {
  Random random(254);
  Registrar registrar(shipped_model(), {.threads = 1});
  for (int trial = 0; trial < 5; ++trial) {
    const Points source = shape(800, random);
    const Points target = moved(cropped(shape(900, random), 0.2, random), random_motion(random, 1));
    const Eigen::Isometry3d there = motion_of(registrar.align(source, target).T_target_source);
    const Eigen::Isometry3d back = motion_of(registrar.align(target, source).T_target_source);
    CAPTURE(trial);
    REQUIRE(rotation_error_deg(back, there.inverse()) < 3);
    REQUIRE((back.translation() - there.inverse().translation()).norm() < 0.05);
  }
}

TEST_CASE("1, 2 and 3 threads give the same bits, and so does the second time") {
  Random random(255);
  const Points source = shape(700, random);
  const Points target = moved(cropped(shape(800, random), 0.3, random), random_motion(random, 1));
  Registrar one(shipped_model(), {.threads = 1});
  const Result expected = one.align(source, target);
  REQUIRE(expected.has_pose);
  for (const int threads : {1, 2, 3}) {
    Registrar registrar(shipped_model(), {.threads = threads});
    for (int repeat = 0; repeat < 2; ++repeat) {
      const Result& result = registrar.align(source, target);
      CAPTURE(threads, repeat);
      REQUIRE(result.T_target_source == expected.T_target_source);
      REQUIRE(result.T_target_source_coarse == expected.T_target_source_coarse);
      REQUIRE(result.covariance == expected.covariance);
      REQUIRE(result.evidence.values() == expected.evidence.values());
      REQUIRE(result.status == expected.status);
      REQUIRE(result.alternatives.size() == expected.alternatives.size());
      for (std::size_t i = 0; i < expected.alternatives.size(); ++i) {
        REQUIRE(result.alternatives[i].T_target_source == expected.alternatives[i].T_target_source);
        REQUIRE(result.alternatives[i].score == expected.alternatives[i].score);
      }
    }
  }
}

}  // namespace
}  // namespace vnreg::test
