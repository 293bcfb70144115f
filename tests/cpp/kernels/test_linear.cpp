#include "kernels/linear.hpp"

#include "helpers.hpp"
#include "kernels/reference/dense.hpp"

namespace vnreg::kernels::test {
namespace {

TEST_CASE("linear with bias equals the naive layer") {
  Random random(51);
  for (const Index out : {1, 3, 5, 16, 47, 128}) {
    for (const Index in : {1, 5, 48}) {
      const std::vector<float> w = random.weights(out, in);
      const std::vector<float> b = random.numbers(out);
      const Linear layer(Eigen::Map<const RowMajorMatrix>(w.data(), out, in), b);
      for (const Index columns : {1, 2, 7, 64, 65}) {
        const std::vector<float> x = random.numbers(in * columns);
        GuardedFloats y(layer.padded_rows() * columns);
        linear(layer, x.data(), in, columns, y.data());
        NormalisedError error;
        for (Index j = 0; j < columns; ++j) {
          const reference::Row row(x.begin() + j * in, x.begin() + (j + 1) * in);
          const reference::Row expected = reference::linear(w, b, row);
          for (Index o = 0; o < out; ++o) {
            error.add(static_cast<double>(y.data()[j * layer.padded_rows() + o]),
                      expected[static_cast<std::size_t>(o)]);
          }
        }
        CAPTURE(out, in, columns);
        REQUIRE(y.intact());
        REQUIRE(error.value() < 1e-6);
      }
    }
  }
}

TEST_CASE("a large bias does not cost the sum its digits") {
  // 0.1 + 4096 * 1e-8: added one by one to 0.1, the small terms would round away.
  const std::vector<float> w(4096, 1.0f);
  const std::vector<float> b{0.1f};
  const Linear layer(Eigen::Map<const RowMajorMatrix>(w.data(), 1, 4096), b);
  const std::vector<float> x(4096, 1e-9f);
  Floats y(static_cast<std::size_t>(layer.padded_rows()));
  linear(layer, x.data(), 4096, 1, y.data());
  REQUIRE(std::abs(static_cast<double>(y[0]) - (static_cast<double>(0.1f) + 4.096e-6)) < 1e-8);
}

TEST_CASE("ReLU keeps what is positive") {
  for (const Index count : {1, 3, 7, 8, 9, 64, 65}) {
    GuardedFloats x(count);
    for (Index i = 0; i < count; ++i) x.data()[i] = static_cast<float>(i % 3 - 1);
    relu(x.data(), count);
    REQUIRE(x.intact());
    for (Index i = 0; i < count; ++i) REQUIRE(x.data()[i] == (i % 3 == 2 ? 1.0f : 0.0f));
  }
}

TEST_CASE("the sigmoid stays finite at any size of its argument") {
  REQUIRE(sigmoid(0.0f) == 0.5f);
  REQUIRE(sigmoid(200.0f) == 1.0f);
  REQUIRE(sigmoid(-200.0f) == 0.0f);
  REQUIRE(sigmoid(1.0f) == Approx(0.7310586));
}

}  // namespace
}  // namespace vnreg::kernels::test
