#include "kernels/vn_lean.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

using reference::Vectors;

RowMajorMatrix matrix(const std::vector<float>& w, Index rows, Index cols) {
  return Eigen::Map<const RowMajorMatrix>(w.data(), rows, cols);
}

Vectors naive_normalized(const Vectors& v) {
  Vectors n = v;
  for (Index p = 0; p < v.points; ++p) {
    double squared = 0;
    for (Index c = 0; c < v.channels; ++c) {
      for (Index axis = 0; axis < 3; ++axis) squared += v.at(p, c, axis) * v.at(p, c, axis);
    }
    const double length = std::sqrt(squared / static_cast<double>(v.channels) + 0.01);
    for (Index c = 0; c < v.channels; ++c) {
      for (Index axis = 0; axis < 3; ++axis) n.at(p, c, axis) /= length;
    }
  }
  return n;
}

TEST_CASE("the lean block equals its definition") {
  Random random(91);
  // One channel alone would be parallel to its direction: what is left of it is rounding.
  for (const Index channels : {3, 8, 13, 32, 48}) {
    for (const Index points : {1, 2, 31, 32}) {
      const Vectors v = random.vectors(points, channels);
      const std::vector<float> u = random.weights(channels, channels);
      const std::vector<float> w = random.weights(channels, channels);
      const Vectors n = naive_normalized(v);
      const Vectors h = reference::vn_relu(u, false, n);
      Vectors expected = reference::vn_linear(w, channels, h);
      for (std::size_t i = 0; i < expected.values.size(); ++i) expected.values[i] += v.values[i];

      const LeanBlock block{PackedMatrix(matrix(u, channels, channels)),
                            PackedMatrix(matrix(w, channels, channels)), PackedMatrix{}};
      Floats tile = to_tile(v);
      GuardedFloats normalized(static_cast<Index>(tile.size()));
      GuardedFloats hidden(static_cast<Index>(tile.size()));
      lean_block(block, points, tile.data(), normalized.data(), hidden.data());
      CAPTURE(channels, points);
      REQUIRE(tile_error(normalized.data(), n) < 1e-6);
      REQUIRE(tile_error(hidden.data(), h) < 1e-5);
      REQUIRE(tile_error(tile.data(), expected) < 1e-5);
      REQUIRE(normalized.intact());
      REQUIRE(hidden.intact());
    }
  }
}

TEST_CASE("a vector added to all points is added to each") {
  Random random(92);
  for (const Index channels : {1, 5, 32}) {
    const Vectors v = random.vectors(7, channels), m = random.vectors(1, channels);
    Vectors expected = v;
    for (Index p = 0; p < 7; ++p) {
      for (Index c = 0; c < channels; ++c) {
        for (Index axis = 0; axis < 3; ++axis) expected.at(p, c, axis) += m.at(0, c, axis);
      }
    }
    Floats tile = to_tile(v);
    add_to_points(to_tile(m).data(), padded(channels), 7, tile.data());
    REQUIRE(tile_error(tile.data(), expected) < 1e-6);
  }
}

TEST_CASE("partner products are inner products, partner by partner") {
  Random random(93);
  for (const Index channels : {1, 5, 32, 47}) {
    for (const Index partners : {1, 3, 4}) {
      for (const bool shared : {false, true}) {
        constexpr Index points = 9;
        const Vectors v = random.vectors(points, channels);
        const Vectors q = random.vectors(shared ? 1 : points, partners);
        const Index rows = padded(channels), stride = partners * rows + packet_size;
        GuardedFloats out(stride * points);
        std::fill_n(out.data(), stride * points, -7.0f);
        partner_products(to_tile(v).data(), rows, to_tile(q).data(), padded(partners), shared,
                         partners, points, out.data(), stride);
        NormalisedError error;
        for (Index p = 0; p < points; ++p) {
          for (Index k = 0; k < partners; ++k) {
            for (Index c = 0; c < channels; ++c) {
              double expected = 0;
              for (Index axis = 0; axis < 3; ++axis) {
                expected += v.at(p, c, axis) * q.at(shared ? 0 : p, k, axis);
              }
              error.add(double{out.data()[p * stride + k * rows + c]}, expected);
            }
          }
          REQUIRE(out.data()[p * stride + partners * rows] == -7.0f);
        }
        CAPTURE(channels, partners, shared);
        REQUIRE(error.value() < 1e-6);
        REQUIRE(out.intact());
      }
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
