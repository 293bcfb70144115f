// The covariance of mode verified: what it promises for any pair, and how it moves with the frame.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

const Widths narrow{.global = 8, .local = 8};

Registrar verifier(double inflation = 1) {
  ModelDraft draft = random_model(narrow);
  draft.metadata["calibration.verified.covariance"] = inflation;
  return Registrar(draft.build(), {.threads = 1});
}

Matrix6 matrix(const Result& result) { return Eigen::Map<const Matrix6>(result.covariance.data()); }

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// How far b is from a: the largest of |eigenvalue - 1| of b relative to a.
double relative_difference(const Matrix6& a, const Matrix6& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> solver(b, a, Eigen::EigenvaluesOnly);
  return (solver.eigenvalues().array() - 1).abs().maxCoeff();
}

Points with_noise(Points points, double deviation, Random& random) {
  for (auto& p : points) {
    for (double& v : p) v += deviation * random.normal();
  }
  return points;
}

TEST_CASE("a covariance is finite, symmetric and positive definite for any pair") {
  const int seed = GENERATE(range(0, 20));
  Random random(static_cast<std::uint64_t>(100 + seed));
  Registrar registrar = verifier();
  const Points target = moved(shape(150 + 10 * static_cast<std::size_t>(seed), random),
                              random_motion(random, 3), std::pow(10, random.uniform(-3, 3)));
  // Even seeds: a pair. Odd seeds: clouds that have nothing to do with each other.
  Points source = with_noise(target, seed % 4 == 0 ? 0 : 1e-3, random);
  if (seed % 2 == 1) {
    for (auto& p : source) p = {random.normal(), random.normal(), random.uniform(0, 1)};
  }
  const Result& r = registrar.align(source, target);
  CAPTURE(seed);
  REQUIRE(r.has_pose);
  const Matrix6 c = matrix(r);
  REQUIRE(c.allFinite());
  REQUIRE(c == c.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(c, Eigen::EigenvaluesOnly);
  REQUIRE(solver.eigenvalues()(0) > 0);
}

TEST_CASE("a covariance moves with the target's frame") {
  const int seed = GENERATE(range(0, 5));
  Random random(static_cast<std::uint64_t>(130 + seed));
  Registrar registrar = verifier();
  // The same points, so that both poses are the truth up to rounding.
  const Points source = shape(400, random);
  const Points target = moved(source, random_motion(random, 1));
  const Eigen::Isometry3d motion = random_motion(random, 5);
  const Matrix6 before = matrix(registrar.align(source, target));
  const Matrix6 after = matrix(registrar.align(source, moved(target, motion)));

  Matrix6 adjoint = Matrix6::Zero();
  adjoint.topLeftCorner<3, 3>() = motion.linear();
  adjoint.bottomRightCorner<3, 3>() = motion.linear();
  adjoint.bottomLeftCorner<3, 3>() = cross_matrix(motion.translation()) * motion.linear();
  CAPTURE(seed);
  REQUIRE(relative_difference(adjoint * before * adjoint.transpose(), after) < 0.05);
  REQUIRE(relative_difference(before, after) > 1);
}

TEST_CASE("a covariance has the units of the input") {
  Random random(140);
  Registrar registrar = verifier();
  const Points source = shape(300, random);
  const Points target = moved(source, random_motion(random, 1));
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  const Matrix6 metres = matrix(registrar.align(source, target));
  const Matrix6 millimetres =
      matrix(registrar.align(moved(source, still, 1000), moved(target, still, 1000)));
  Eigen::Array<double, 6, 1> units;
  units << 1, 1, 1, 1000, 1000, 1000;
  const Matrix6 expected = units.matrix().asDiagonal() * metres * units.matrix().asDiagonal();
  REQUIRE(relative_difference(expected, millimetres) < 0.01);
}

TEST_CASE("more noise, more uncertainty") {
  Random random(141);
  Registrar registrar = verifier();
  const Eigen::Isometry3d truth = random_motion(random, 0);
  double last = 0;
  for (const double noise : {0.002, 0.03}) {
    const Points source = with_noise(shape(600, random), noise, random);
    const Points target = moved(with_noise(shape(600, random), noise, random), truth);
    const double variance = matrix(registrar.align(source, target)).topLeftCorner<3, 3>().trace();
    REQUIRE(variance > 2 * last);
    last = variance;
  }
}

/// Three plates of unequal sizes that meet in a corner, `thickness` thick; both of their sides or
/// only the outer one.
Points plates(std::size_t count, double thickness, bool both_sides, Random& random) {
  const double size[3] = {1, 0.8, 0.55};
  Points points(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) points[i][axis] = random.uniform(0, size[axis]);
    const bool inner = both_sides && i % 2 == 1;
    points[i][i % 3] = inner ? thickness : 0;
  }
  return points;
}

TEST_CASE("a scan of one side of plates comes to lie between both, and the covariance knows") {
  Random random(146);
  Registrar registrar(Model::builtin(), {.threads = 1});
  double sum = 0;
  constexpr int pairs = 12;
  for (int i = 0; i < pairs; ++i) {
    const Eigen::Isometry3d truth = random_motion(random, 0);
    const Result& r = registrar.align(plates(700, 0.03, false, random),
                                      moved(plates(1024, 0.03, true, random), truth));
    const Eigen::Isometry3d pose = motion_of(r.T_target_source);
    REQUIRE(rotation_error_deg(pose, truth) < 5);
    const Eigen::AngleAxisd turn(truth.linear() * pose.linear().transpose());
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), truth.translation() - turn * pose.translation();
    REQUIRE(error.tail<3>().norm() > 0.005);
    sum += error.dot(matrix(r).ldlt().solve(error));
  }
  REQUIRE(sum / pairs < 18);  // 6 where errors are as it says; 450 when it does not know
}

TEST_CASE("what the shape does not hold is uncertain, not singular") {
  Random random(142);
  Registrar registrar = verifier();
  const auto vase = [&] {  // turned about z: any angle about it will do
    Points points(600);
    for (auto& p : points) {
      const double height = random.uniform(-0.5, 0.5);
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      const double radius = 0.2 + 0.1 * height + 0.15 * height * height;
      p = {radius * std::cos(angle), radius * std::sin(angle), height};
    }
    return points;
  };
  const Eigen::Isometry3d truth = random_motion(random, 0);
  const Result& r = registrar.align(vase(), moved(vase(), truth));
  REQUIRE(r.has_pose);
  const Eigen::Matrix3d turns = matrix(r).topLeftCorner<3, 3>();
  const Eigen::Vector3d axis = truth.linear().col(2);
  const Eigen::Vector3d across = truth.linear().col(0);
  REQUIRE(axis.dot(turns * axis) > 10 * across.dot(turns * across));
  REQUIRE(axis.dot(turns * axis) < 10);
}

TEST_CASE("the model may inflate the covariance") {
  Random random(143);
  const Points source = shape(200, random);
  const Points target = moved(shape(200, random), random_motion(random, 1));
  Registrar plain = verifier();
  Registrar inflated = verifier(4);
  const Matrix6 expected = 4 * matrix(plain.align(source, target));
  REQUIRE((matrix(inflated.align(source, target)) - expected).norm() < 1e-12 * expected.norm());
}

TEST_CASE("no covariance without a pose, in other modes, or beyond float64") {
  Random random(144);
  const Points cloud = shape(200, random);
  const auto unknown = [](const Result& r) {
    return std::all_of(r.covariance.begin(), r.covariance.end(),
                       [](double v) { return std::isnan(v); });
  };
  Registrar registrar = verifier();
  REQUIRE(unknown(registrar.align(cloud, shape(5, random))));
  REQUIRE(unknown(registrar.align(cloud, Points(100, {1, 2, 3}))));
  for (const Mode mode : {Mode::coarse, Mode::paper}) {
    Registrar other(random_model(narrow).build(), {.mode = mode, .threads = 1});
    const Result& r = other.align(cloud, cloud);
    REQUIRE(r.has_pose);
    REQUIRE(unknown(r));
  }
  Points far = moved(cloud, Eigen::Isometry3d::Identity(), 1e190);
  for (auto& p : far) p[0] += 1e195;
  const Result& r = registrar.align(far, far);
  REQUIRE(r.has_pose);
  REQUIRE(unknown(r));
  const Points tiny = moved(cloud, Eigen::Isometry3d::Identity(), 1e-200);
  const Result& small = registrar.align(tiny, tiny);
  REQUIRE(small.has_pose);
  REQUIRE(unknown(small));
}

}  // namespace
}  // namespace vnreg::test
