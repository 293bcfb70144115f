#include "kernels/procrustes.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

struct Paired {
  std::vector<float> x[3], y[3], weights;

  Paired(Index count, const RigidTransform& truth, float noise, Random& random) {
    for (Index i = 0; i < count; ++i) {
      const Eigen::Vector3d p(static_cast<double>(random.normal()),
                              static_cast<double>(random.normal()),
                              static_cast<double>(random.normal()));
      const Eigen::Vector3d q = truth.rotation * p + truth.translation;
      for (int axis = 0; axis < 3; ++axis) {
        x[axis].push_back(static_cast<float>(p(axis)));
        y[axis].push_back(static_cast<float>(q(axis)) + noise * random.normal());
      }
      weights.push_back(random.uniform(0.0f, 1.0f));
    }
  }
  Coordinates source() const { return {x[0].data(), x[1].data(), x[2].data()}; }
  Coordinates target() const { return {y[0].data(), y[1].data(), y[2].data()}; }

  double cost(const RigidTransform& t) const {
    double sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const Eigen::Vector3d p(x[0][i], x[1][i], x[2][i]);
      const Eigen::Vector3d q(y[0][i], y[1][i], y[2][i]);
      sum += static_cast<double>(weights[i]) * (t.rotation * p + t.translation - q).squaredNorm();
    }
    return sum;
  }
};

RigidTransform random_transform(Random& random) {
  const Eigen::Quaterniond q(random.normal(), random.normal(), random.normal(), random.normal());
  return {q.normalized().toRotationMatrix(),
          Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
}

bool is_rotation(const Eigen::Matrix3d& r) {
  return (r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12 &&
         std::abs(r.determinant() - 1) < 1e-12;
}

TEST_CASE("exact pairs give back the transform that made them") {
  Random random(81);
  for (const Index count : {3, 4, 7, 63, 333}) {
    for (int trial = 0; trial < 20; ++trial) {
      const RigidTransform truth = random_transform(random);
      const Paired pairs(count, truth, 0.0f, random);
      for (const float* weights : {static_cast<const float*>(nullptr), pairs.weights.data()}) {
        const auto s = procrustes(pairs.source(), pairs.target(), weights, count);
        CAPTURE(count, trial);
        REQUIRE(is_rotation(s.transform.rotation));
        REQUIRE((s.transform.rotation - truth.rotation).norm() < 2e-5);
        REQUIRE((s.transform.translation - truth.translation).norm() < 2e-5);
      }
    }
  }
}

TEST_CASE("with noise and weights, no small motion improves the weighted cost") {
  Random random(82);
  for (int trial = 0; trial < 20; ++trial) {
    const Paired pairs(65, random_transform(random), 0.5f, random);
    const auto s = procrustes(pairs.source(), pairs.target(), pairs.weights.data(), 65);
    REQUIRE(is_rotation(s.transform.rotation));
    const double best = pairs.cost(s.transform);
    for (int axis = 0; axis < 3; ++axis) {
      for (const double step : {-1e-3, 1e-3}) {
        RigidTransform turned = s.transform;
        turned.rotation = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(axis)).toRotationMatrix() *
                          turned.rotation;
        RigidTransform moved = s.transform;
        moved.translation(axis) += step;
        REQUIRE(pairs.cost(turned) > best);
        REQUIRE(pairs.cost(moved) > best);
      }
    }
  }
}

TEST_CASE("mirrored pairs still give a rotation") {
  Random random(83);
  RigidTransform mirror;
  mirror.rotation(2, 2) = -1;
  const Paired pairs(65, mirror, 0.0f, random);
  const auto s = procrustes(pairs.source(), pairs.target(), nullptr, 65);
  REQUIRE(is_rotation(s.transform.rotation));
}

TEST_CASE("singular values tell the rank of the pairs") {
  Random random(84);
  Paired pairs(65, RigidTransform{}, 0.0f, random);
  REQUIRE(procrustes(pairs.source(), pairs.target(), nullptr, 65).singular_values(2) > 1);
  for (auto* axis : {&pairs.x[2], &pairs.y[2]}) std::fill(axis->begin(), axis->end(), 2.0f);
  const auto planar = procrustes(pairs.source(), pairs.target(), nullptr, 65);
  REQUIRE(planar.singular_values(1) > 1);
  REQUIRE(planar.singular_values(2) < 1e-12);
  REQUIRE((planar.transform.rotation - Eigen::Matrix3d::Identity()).norm() < 1e-6);
  for (auto* axis : {&pairs.x[1], &pairs.y[1]}) std::fill(axis->begin(), axis->end(), -3.0f);
  const auto linear = procrustes(pairs.source(), pairs.target(), nullptr, 65);
  REQUIRE(linear.singular_values(0) > 1);
  REQUIRE(linear.singular_values(1) < 1e-12);
  REQUIRE(is_rotation(linear.transform.rotation));
}

TEST_CASE("no weight at all, or coinciding points: a finite motion and no rank") {
  Random random(85);
  const Paired pairs(7, random_transform(random), 0.0f, random);
  const std::vector<float> none(7, 0.0f);
  const auto unweighted = procrustes(pairs.source(), pairs.target(), none.data(), 7);
  REQUIRE(unweighted.transform.rotation == Eigen::Matrix3d::Identity());
  REQUIRE(unweighted.singular_values.isZero(0));
  std::vector<float> only_one(7, 0.0f);
  only_one[3] = 1.0f;
  const auto single = procrustes(pairs.source(), pairs.target(), only_one.data(), 7);
  REQUIRE(is_rotation(single.transform.rotation));
  REQUIRE(single.transform.translation.allFinite());
  REQUIRE(single.singular_values(0) < 1e-12);
}

TEST_CASE("numbers that are not finite give the identity") {
  Random random(87);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (int where = 0; where < 3; ++where) {
      Paired pairs(7, random_transform(random), 0.0f, random);
      (where == 0 ? pairs.x[1][3] : where == 1 ? pairs.y[2][6] : pairs.weights[0]) = bad;
      const auto s = procrustes(pairs.source(), pairs.target(), pairs.weights.data(), 7);
      REQUIRE(s.transform.rotation == Eigen::Matrix3d::Identity());
      REQUIRE(s.transform.translation.isZero(0));
      REQUIRE(s.singular_values.isZero(0));
    }
  }
}

TEST_CASE("composition does the second motion first") {
  Random random(86);
  const RigidTransform a = random_transform(random);
  const RigidTransform b = random_transform(random);
  const RigidTransform both = compose(a, b);
  const Eigen::Vector3d p(0.3, -2, 5);
  const Eigen::Vector3d expected = a.rotation * (b.rotation * p + b.translation) + a.translation;
  REQUIRE((both.rotation * p + both.translation - expected).norm() < 1e-12);
}

}  // namespace
}  // namespace vnreg::kernels::test
