#include "kernels/fit_rotations.hpp"

#include <Eigen/Geometry>

#include "helpers.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::kernels::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d random_vector(Random& random) {
  return Vector3d::NullaryExpr([&] { return static_cast<double>(random.normal()); });
}

Matrix3d random_rotation(Random& random) {
  return Eigen::AngleAxisd(random_vector(random).norm(), random_vector(random).normalized())
      .toRotationMatrix();
}

/// With these singular values, the last negative for a negative determinant.
Matrix3d matrix_of(const Vector3d& singular_values, Random& random) {
  return random_rotation(random) * singular_values.asDiagonal() * random_rotation(random);
}

struct Fitted {
  std::vector<Matrix3d> rotation;
  std::vector<bool> determined;
};

Fitted fit_all(const std::vector<Matrix3d>& matrices) {
  const auto count = static_cast<Index>(matrices.size());
  MatrixBatch h{}, rotation;
  for (Index i = 0; i < count; ++i) {
    for (int k = 0; k < 9; ++k) {
      h.entry[k][i] = matrices[static_cast<std::size_t>(i)](k / 3, k % 3);
    }
  }
  bool determined[MatrixBatch::capacity];
  fit_rotations(h, count, rotation, determined);
  Fitted result;
  for (Index i = 0; i < count; ++i) {
    Matrix3d r;
    for (int k = 0; k < 9; ++k) r(k / 3, k % 3) = rotation.entry[k][i];
    result.rotation.push_back(r);
    result.determined.push_back(determined[i]);
  }
  return result;
}

TEST_CASE("many rotations are fitted like one by its singular values, for any number of them") {
  Random random(171);
  const Vector3d kinds[] = {{1, 1, 1},      {1, 0.7, 0.2},   {1, 0.7, -0.2}, {1, 1, -0.5},
                            {1, 1e-2, 0.0}, {1, 0.5, 1e-14}, {1, 1e-3, 1e-3}};
  for (const Index count : {0, 1, 3, 5, 63, 64}) {
    std::vector<Matrix3d> matrices;
    for (Index i = 0; i < count; ++i) {
      const double scale = std::pow(10.0, static_cast<double>(random.uniform(-9, 9)));
      matrices.push_back(scale * matrix_of(kinds[i % 7], random));
    }
    const Fitted fitted = fit_all(matrices);
    for (std::size_t i = 0; i < matrices.size(); ++i) {
      CAPTURE(count, i);
      REQUIRE(fitted.determined[i]);
      REQUIRE((fitted.rotation[i] - fit_rotation(matrices[i]).rotation).norm() < 1e-7);
      REQUIRE((fitted.rotation[i] * fitted.rotation[i].transpose() - Matrix3d::Identity()).norm() <
              1e-12);
    }
  }
}

TEST_CASE("where no rotation is determined, the fit says so and stays finite") {
  Random random(172);
  const Vector3d kinds[] = {{0, 0, 0}, {1, 0, 0}, {1, 1e-9, 0}, {1, 0.4, -0.4}, {1, 1, -1}};
  for (const Vector3d& kind : kinds) {
    for (int trial = 0; trial < 30; ++trial) {
      const Fitted fitted = fit_all({matrix_of(kind, random)});
      CAPTURE(kind.transpose(), trial);
      REQUIRE(!fitted.determined[0]);
      REQUIRE(fitted.rotation[0].allFinite());
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
