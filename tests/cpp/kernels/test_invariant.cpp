#include "kernels/invariant.hpp"

#include "helpers.hpp"
#include "kernels/reference/dense.hpp"

namespace vnreg::kernels::test {
namespace {

RowMajorMatrix matrix(const std::vector<float>& values, Index rows, Index cols) {
  return Eigen::Map<const RowMajorMatrix>(values.data(), rows, cols);
}

TEST_CASE("VN-linear, batch norm and VN-ReLU equal the naive layer") {
  Random random(41);
  // One input channel is left out: then every direction is parallel to its vector, and the result
  // is either the vector or rounding noise.
  for (const Index in : {2, 3, 5, 16, 47, 48, 128}) {
    const Index out = (in + 1) / 2;
    for (const bool shared : {false, true}) {
      const std::vector<float> fc = random.weights(out, in);
      const std::vector<float> direction = random.weights(shared ? 1 : out, in);
      const std::vector<float> scale = random.numbers(out);
      const std::vector<float> shift = random.numbers(out);
      const VnNormLayer layer = make_vn_norm_layer(
          matrix(fc, out, in), matrix(direction, shared ? 1 : out, in), scale, shift, shared);
      for (const Index points : {1, 2, 3, 7, 64, 65}) {
        const reference::Vectors v = random.vectors(points, in);
        Floats projected(static_cast<std::size_t>(layer.out_rows() * 3 * points));
        Floats directions(static_cast<std::size_t>(packet_size * 3 * points));
        GuardedFloats result(layer.out_rows() * 3 * points);
        vn_norm_layer(layer, to_tile(v).data(), padded(in), points, projected.data(),
                      directions.data(), result.data());
        CAPTURE(in, shared, points);
        REQUIRE(result.intact());
        REQUIRE(tile_error(result.data(), reference::vn_norm_layer(fc, direction, scale, shift,
                                                                   shared, v)) < 2e-5);
      }
    }
  }
}

TEST_CASE("a zero vector passes the batch norm without dividing by zero") {
  const std::vector<float> ones(8, 1.0f);
  const VnNormLayer layer =
      make_vn_norm_layer(matrix(ones, 8, 1), matrix(ones, 8, 1), ones, ones, false);
  const Floats v(static_cast<std::size_t>(3 * padded(1)), 0.0f);
  Floats projected(static_cast<std::size_t>(3 * padded(8)), 1.0f);
  Floats result = projected;
  vn_norm_layer(layer, v.data(), padded(1), 1, projected.data(), nullptr, result.data());
  REQUIRE(std::all_of(result.begin(), result.end(), [](float x) { return x == 0.0f; }));
}

TEST_CASE("V Z^T and the descriptor layer that reads it") {
  Random random(42);
  for (const Index channels : {1, 3, 5, 16, 47, 48, 128}) {
    for (const Index points : {1, 2, 3, 7, 63}) {
      const Index out = 7;
      const std::vector<float> w = random.weights(out, 3 * channels);
      const std::vector<float> b = random.numbers(out);
      const reference::Vectors v = random.vectors(points, channels);
      const reference::Vectors z = random.vectors(points, 3);
      const Index rows = padded(channels);
      GuardedFloats products(3 * rows * points);
      invariant_products(to_tile(v).data(), rows, to_tile(z).data(), padded(3), points,
                         products.data());
      const reference::Rows expected = reference::invariant_products(v, z);
      NormalisedError error;
      for (Index p = 0; p < points; ++p) {
        for (Index c = 0; c < channels; ++c) {
          for (Index f = 0; f < 3; ++f) {
            error.add(static_cast<double>(products.data()[(3 * p + f) * rows + c]),
                      expected[static_cast<std::size_t>(p)][static_cast<std::size_t>(3 * c + f)]);
          }
        }
      }
      CAPTURE(channels, points);
      REQUIRE(products.intact());
      REQUIRE(error.value() < 2e-6);

      const Linear layer = make_descriptor_layer(matrix(w, out, 3 * channels), b, channels);
      GuardedFloats descriptors(layer.padded_rows() * points);
      linear(layer, products.data(), 3 * rows, points, descriptors.data());
      NormalisedError descriptor_error;
      for (Index p = 0; p < points; ++p) {
        const reference::Row row = reference::linear(w, b, expected[static_cast<std::size_t>(p)]);
        for (Index o = 0; o < out; ++o) {
          descriptor_error.add(static_cast<double>(descriptors.data()[p * layer.padded_rows() + o]),
                               row[static_cast<std::size_t>(o)]);
        }
      }
      REQUIRE(descriptors.intact());
      REQUIRE(descriptor_error.value() < 5e-6);
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
