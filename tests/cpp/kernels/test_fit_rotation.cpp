#include <Eigen/Geometry>
#include <Eigen/LU>

#include "helpers.hpp"
#include "kernels/procrustes.hpp"

namespace vnreg::kernels::test {
namespace {

using Eigen::Matrix3d;

Matrix3d random_matrix(Random& random) {
  return Matrix3d::NullaryExpr([&] { return static_cast<double>(random.normal()); });
}

Matrix3d random_rotation(Random& random) {
  const Eigen::Vector4f q(random.normal(), random.normal(), random.normal(), random.normal());
  return Eigen::Quaterniond(q.cast<double>().normalized()).toRotationMatrix();
}

void require_rotation(const Matrix3d& r) {
  REQUIRE((r * r.transpose() - Matrix3d::Identity()).norm() < 1e-12);
  REQUIRE(std::abs(r.determinant() - 1) < 1e-12);
}

TEST_CASE("any matrix gives a rotation, whatever its rank, sign and scale") {
  Random random(101);
  for (const double scale : {1e-150, 1e-12, 1.0, 1e12, 1e150}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Matrix3d full = scale * random_matrix(random);
      const Matrix3d rank_one = full.col(0) * random_matrix(random).row(0);
      const Matrix3d rank_two = rank_one + full.col(1) * random_matrix(random).row(1);
      for (const Matrix3d& h : {full, Matrix3d(-full), rank_one, rank_two}) {
        CAPTURE(scale, trial, h.determinant());
        require_rotation(fit_rotation(h).rotation);
      }
    }
  }
  require_rotation(fit_rotation(Matrix3d::Zero()).rotation);
  require_rotation(fit_rotation(Matrix3d::Identity()).rotation);
  require_rotation(fit_rotation(-Matrix3d::Identity()).rotation);
}

TEST_CASE("vectors and their turned copies give back the rotation") {
  Random random(102);
  for (const Index count : {2, 3, 7, 64}) {  // two that are not parallel are enough
    for (int trial = 0; trial < 20; ++trial) {
      const Matrix3d truth = random_rotation(random);
      Matrix3d h = Matrix3d::Zero();
      for (Index i = 0; i < count; ++i) {
        const Eigen::Vector3d x = random_matrix(random).col(0);
        h += truth * x * x.transpose();
      }
      const RotationFit fit = fit_rotation(h);
      CAPTURE(count, trial);
      REQUIRE(fit.singular_values(1) > 1e-9 * fit.singular_values(0));
      REQUIRE((fit.rotation - truth).norm() < 1e-5);
    }
  }
}

TEST_CASE("no other rotation has a larger trace, and the singular values tell which it is") {
  Random random(103);
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix3d h = random_matrix(random);
    const RotationFit fit = fit_rotation(h);
    const double best = (fit.rotation.transpose() * h).trace();
    const Eigen::Vector3d s = fit.singular_values;
    REQUIRE((s(0) >= s(1) && s(1) >= s(2) && s(2) >= 0));
    REQUIRE(s.squaredNorm() == Approx(h.squaredNorm()));
    REQUIRE(best == Approx(s(0) + s(1) + (h.determinant() < 0 ? -1 : 1) * s(2)));
    for (int other = 0; other < 50; ++other) {
      REQUIRE((random_rotation(random).transpose() * h).trace() <= best + 1e-12);
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
