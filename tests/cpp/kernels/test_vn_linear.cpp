#include "kernels/vn_linear.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

struct Product {
  Index rows, depth, columns;
  RowMajorMatrix w;
  Eigen::MatrixXf x;
  Eigen::MatrixXd exact;

  Product(Index r, Index k, Index n, Random& random)
      : rows(r), depth(k), columns(n), w(r, k), x(k, n) {
    for (float& v : w.reshaped()) v = random.normal();
    for (float& v : x.reshaped()) v = random.normal();
    exact = w.cast<double>() * x.cast<double>();
  }

  /// The normalised error of y - base against W x; padding rows must equal the base, 0.
  double error(const float* y, Index stride, const Eigen::MatrixXd& base) const {
    NormalisedError error;
    for (Index j = 0; j < columns; ++j) {
      for (Index r = 0; r < padded(rows); ++r) {
        const auto got = static_cast<double>(y[j * stride + r]);
        error.add(got, r < rows ? exact(r, j) + base(r, j) : 0.0);
      }
    }
    return error.value();
  }
};

constexpr Index channel_counts[] = {1, 3, 5, 16, 47, 48, 128};

TEST_CASE("the product equals the naive product for all shapes, and writes nothing else") {
  Random random(1);
  for (const Index rows : channel_counts) {
    for (const Index depth : channel_counts) {
      for (const Index columns : {1, 2, 3, 7, 11, 12, 13, 63, 64, 65, 333}) {
        const Product p(rows, depth, columns, random);
        const PackedMatrix w(p.w);
        CAPTURE(rows, depth, columns);
        GuardedFloats y(w.padded_rows() * columns);
        multiply(w, p.x.data(), depth, columns, y.data(), w.padded_rows());
        REQUIRE(y.intact());
        REQUIRE(p.error(y.data(), w.padded_rows(), Eigen::MatrixXd::Zero(rows, columns)) < 1e-6);
      }
    }
  }
}

TEST_CASE("adding to the output") {
  Random random(2);
  for (const Index rows : channel_counts) {
    const Product p(rows, 17, 64, random);
    const PackedMatrix w(p.w);
    GuardedFloats y(w.padded_rows() * 64);
    Eigen::MatrixXd base = Eigen::MatrixXd::Zero(rows, 64);
    std::fill_n(y.data(), w.padded_rows() * 64, 0.0f);
    for (Index j = 0; j < 64; ++j) {
      for (Index r = 0; r < rows; ++r) {
        const float v = random.normal();
        y.data()[j * w.padded_rows() + r] = v;
        base(r, j) = static_cast<double>(v);
      }
    }
    multiply_add(w, p.x.data(), 17, 64, y.data(), w.padded_rows());
    REQUIRE(y.intact());
    REQUIRE(p.error(y.data(), w.padded_rows(), base) < 1e-6);
  }
}

TEST_CASE("a bias per component: its columns change at multiples of the tile's points") {
  Random random(3);
  for (const Index points : {1, 2, 3, 7, 32, 63, 65}) {
    for (const Index rows : {1, 16, 47}) {
      const Product p(rows, 5, 3 * points, random);
      const PackedMatrix w(p.w);
      Floats bias(static_cast<std::size_t>(3 * w.padded_rows()), 0.0f);
      Eigen::MatrixXd base(rows, 3 * points);
      for (Index axis = 0; axis < 3; ++axis) {
        for (Index r = 0; r < rows; ++r) {
          const float v = random.normal();
          bias[static_cast<std::size_t>(axis * w.padded_rows() + r)] = v;
          base.row(r).segment(axis * points, points).setConstant(static_cast<double>(v));
        }
      }
      CAPTURE(points, rows);
      GuardedFloats y(w.padded_rows() * 3 * points);
      multiply_bias(w, p.x.data(), 5, 3 * points, y.data(), w.padded_rows(), bias.data(),
                    w.padded_rows(), points);
      REQUIRE(y.intact());
      REQUIRE(p.error(y.data(), w.padded_rows(), base) < 1e-6);
    }
  }
}

TEST_CASE("a column's result does not depend on its place among the columns") {
  Random random(4);
  const Product p(47, 128, 65, random);
  const PackedMatrix w(p.w);
  Floats all(static_cast<std::size_t>(w.padded_rows() * 65));
  multiply(w, p.x.data(), 128, 65, all.data(), w.padded_rows());
  for (Index j = 0; j < 65; ++j) {
    Floats one(static_cast<std::size_t>(w.padded_rows()));
    multiply(w, p.x.data() + j * 128, 128, 1, one.data(), w.padded_rows());
    REQUIRE(std::equal(one.begin(), one.end(), all.begin() + j * w.padded_rows()));
  }
}

TEST_CASE("strides larger than the rows leave the rows between untouched") {
  Random random(5);
  const Product p(16, 5, 13, random);
  const PackedMatrix w(p.w);
  Floats y(static_cast<std::size_t>(13 * 40), 9.5f);
  multiply(w, p.x.data(), 5, 13, y.data(), 40);
  REQUIRE(p.error(y.data(), 40, Eigen::MatrixXd::Zero(16, 13)) < 1e-6);
  for (Index j = 0; j < 13; ++j) {
    for (Index r = w.padded_rows(); r < 40; ++r)
      REQUIRE(y[static_cast<std::size_t>(j * 40 + r)] == 9.5f);
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
