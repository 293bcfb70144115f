#include "kernels/pair_features.hpp"

#include "helpers.hpp"
#include "kernels/reference/dense.hpp"

namespace vnreg::kernels::test {
namespace {

struct RandomPairLayer {
  std::vector<float> w0, b0, w1, b1, w2, b2, w3, b3;
  PairTensors tensors;

  RandomPairLayer(Index d, Index p, float gain, Random& random)
      : w0(random.weights(p, 2 * d + 4)),
        b0(random.numbers(p)),
        w1(random.weights(p, p)),
        b1(random.numbers(p)),
        w2(random.weights(p, p)),
        b2(random.numbers(p)),
        w3(random.weights(1, p)),
        b3(random.numbers(1)),
        tensors{d, p, w0, b0, w1, b1, w2, b2, w3, b3} {
    for (float& v : w3) v *= gain;
  }
};

void check(Index d, Index p, Index count, float gain, bool coincide, Random& random) {
  const RandomPairLayer weights(d, p, gain, random);
  const PairLayer layer = make_pair_layer(weights.tensors);
  const std::vector<float> source = random.numbers(d);
  const std::vector<float> targets = random.numbers(d * count);
  std::vector<float> y[3] = {random.numbers(count), random.numbers(count), random.numbers(count)};
  const std::vector<float> x = random.numbers(3);
  if (coincide) {
    for (std::size_t axis = 0; axis < 3; ++axis) y[axis][0] = x[axis];
  }
  Floats source_part(static_cast<std::size_t>(layer.rows));
  Floats target_parts(static_cast<std::size_t>(layer.rows * count));
  linear(layer.source, source.data(), d, 1, source_part.data());
  linear(layer.target, targets.data(), d, count, target_parts.data());
  PairScratch scratch(layer);
  GuardedFloats similarities(count);
  GuardedFloats maximum(layer.rows);
  pair_row(layer, source_part.data(), target_parts.data(), x.data(),
           {y[0].data(), y[1].data(), y[2].data()}, count, scratch, similarities.data(),
           maximum.data());
  REQUIRE((similarities.intact() && maximum.intact()));

  reference::Row expected_maximum(static_cast<std::size_t>(p), -1e30);
  NormalisedError similarity_error;
  const reference::Row source_row(source.begin(), source.end());
  for (Index j = 0; j < count; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const reference::Row target_row(targets.begin() + j * d, targets.begin() + (j + 1) * d);
    const double position[3] = {x[0], x[1], x[2]};
    const double target[3] = {y[0][at], y[1][at], y[2][at]};
    const reference::Row f =
        reference::pair_feature(weights.tensors, source_row, target_row, position, target);
    for (std::size_t i = 0; i < f.size(); ++i) {
      expected_maximum[i] = std::max(expected_maximum[i], f[i]);
    }
    similarity_error.add(static_cast<double>(similarities.data()[j]),
                         reference::similarity(weights.tensors, f));
  }
  NormalisedError maximum_error;
  for (Index i = 0; i < p; ++i) {
    maximum_error.add(static_cast<double>(maximum.data()[i]),
                      expected_maximum[static_cast<std::size_t>(i)]);
  }
  CAPTURE(d, p, count, gain, coincide);
  REQUIRE(similarity_error.value() < 2e-5);
  REQUIRE(maximum_error.value() < 2e-5);
}

TEST_CASE("a row of pairs equals the concatenated features through the naive layers") {
  Random random(91);
  for (const Index d : {1, 3, 47, 64}) {
    for (const Index p : {1, 3, 5, 16, 32, 47}) {
      for (const Index count : {1, 2, 7, 47, 48, 49, 170}) check(d, p, count, 1, false, random);
    }
  }
}

TEST_CASE("a pair at distance zero has no direction, and no NaN") {
  Random random(92);
  check(5, 16, 7, 1, true, random);
}

TEST_CASE("similarities are clamped") {
  Random random(93);
  check(5, 16, 170, 1e3f, false, random);
}

}  // namespace
}  // namespace vnreg::kernels::test
