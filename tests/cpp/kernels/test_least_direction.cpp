#include "kernels/least_direction.hpp"

#include <Eigen/Eigenvalues>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// With these eigenvalues, in a random position, as float32 holds it.
Matrix3d covariance(const Vector3d& eigenvalues, Random& random) {
  const Matrix3d basis = Matrix3d::NullaryExpr([&] { return static_cast<double>(random.normal()); })
                             .householderQr()
                             .householderQ();
  const Matrix3d exact = basis * eigenvalues.asDiagonal() * basis.transpose();
  return exact.cast<float>().cast<double>();
}

std::vector<Vector3d> directions_of(const std::vector<Matrix3d>& matrices) {
  const auto count = static_cast<Index>(matrices.size());
  std::vector<std::vector<float>> entries(6);
  for (const Matrix3d& m : matrices) {
    const double values[6] = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
    for (std::size_t k = 0; k < 6; ++k) entries[k].push_back(static_cast<float>(values[k]));
  }
  GuardedFloats x(count), y(count), z(count);
  least_directions({entries[0].data(), entries[1].data(), entries[2].data(), entries[3].data(),
                    entries[4].data(), entries[5].data()},
                   count, x.data(), y.data(), z.data());
  REQUIRE((x.intact() && y.intact() && z.intact()));
  std::vector<Vector3d> result;
  for (Index i = 0; i < count; ++i) {
    result.push_back(Eigen::Vector3f(x.data()[i], y.data()[i], z.data()[i]).cast<double>());
  }
  return result;
}

/// What a direction leaves of the variance, beside the least possible, relative to the largest.
double excess(const Matrix3d& m, const Vector3d& direction) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(m);
  return (direction.dot(m * direction) - solver.eigenvalues()(0)) / solver.eigenvalues()(2);
}

TEST_CASE("the least direction is that of Eigen's solver, for any number of matrices") {
  Random random(151);
  for (const Index count : {0, 1, 3, 63, 64, 65, 200}) {
    std::vector<Matrix3d> matrices;
    for (Index i = 0; i < count; ++i) {
      const auto uniform = [&](float low, float high) {
        return static_cast<double>(random.uniform(low, high));
      };
      const double scale = std::pow(10.0, uniform(-6, 6));
      matrices.push_back(covariance(
          scale * Vector3d(uniform(0, 0.1f), uniform(0.2f, 1), uniform(0.2f, 1)), random));
    }
    const std::vector<Vector3d> found = directions_of(matrices);
    for (std::size_t i = 0; i < matrices.size(); ++i) {
      const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrices[i]);
      CAPTURE(count, i);
      REQUIRE(found[i].norm() == Approx(1).margin(1e-6));
      REQUIRE(std::abs(found[i].dot(solver.eigenvectors().col(0))) == Approx(1).margin(1e-6));
    }
  }
}

TEST_CASE("planes, lines, balls and points have a least direction, too") {
  Random random(152);
  const Vector3d shapes[] = {{0, 1, 1},       {0, 1e-3, 1},  {0, 1e-6, 1}, {0, 0, 1},
                             {1e-4, 1e-4, 1}, {0.5, 0.5, 1}, {1, 1, 1},    {0, 0, 0}};
  for (const Vector3d& eigenvalues : shapes) {
    for (int trial = 0; trial < 50; ++trial) {
      const Matrix3d matrix = covariance(eigenvalues, random);
      const Vector3d direction = directions_of({matrix})[0];
      CAPTURE(eigenvalues.transpose(), trial);
      REQUIRE(direction.norm() == Approx(1).margin(1e-6));
      if (!matrix.isZero(0)) REQUIRE(excess(matrix, direction) < 1e-4);
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
