#include "kernels/vn_relu.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

constexpr Index channel_counts[] = {1, 3, 5, 16, 47, 48, 128};

TEST_CASE("VN-ReLU with a direction per channel equals the naive one") {
  Random random(11);
  for (const Index channels : channel_counts) {
    for (const Index points : {1, 2, 3, 7, 63, 64, 65, 333}) {
      const reference::Vectors v = random.vectors(points, channels);
      const reference::Vectors d = random.vectors(points, channels);
      const Floats v_tile = to_tile(v);
      const Floats d_tile = to_tile(d);
      const Index rows = padded(channels);
      GuardedFloats out(rows * 3 * points);
      std::copy(d_tile.begin(), d_tile.end(), out.data());
      vn_relu(points, rows, tile_view(v_tile.data(), rows, points),
              tile_view(out.data(), rows, points));
      CAPTURE(channels, points);
      REQUIRE(out.intact());
      REQUIRE(tile_error(out.data(), reference::clip_to_half_space(v, d)) < 2e-6);
    }
  }
}

TEST_CASE("VN-ReLU with a shared direction equals the naive one, also in place") {
  Random random(12);
  for (const Index channels : channel_counts) {
    for (const Index points : {1, 2, 3, 7, 63, 64, 65, 333}) {
      const reference::Vectors v = random.vectors(points, channels);
      const reference::Vectors d = random.vectors(points, 1);
      const reference::Vectors expected = reference::clip_to_half_space(v, d);
      const Floats d_tile = to_tile(d);
      const Index rows = padded(channels);
      const Floats v_tile = to_tile(v);
      GuardedFloats out(rows * 3 * points);
      const VectorsView direction = tile_view(d_tile.data(), padded(1), points);
      vn_relu_shared(points, rows, tile_view(v_tile.data(), rows, points), direction,
                     tile_view(out.data(), rows, points));
      CAPTURE(channels, points);
      REQUIRE(out.intact());
      REQUIRE(tile_error(out.data(), expected) < 2e-6);

      Floats in_place = v_tile;
      vn_relu_shared(points, rows, tile_view<const float>(in_place.data(), rows, points), direction,
                     tile_view(in_place.data(), rows, points));
      REQUIRE(std::equal(in_place.begin(), in_place.end(), out.data()));
    }
  }
}

TEST_CASE("a vector along its direction stays bit for bit; one against it vanishes") {
  const float v[] = {0.3f, -0.2f, 0.9f};
  for (const float sign : {1.0f, -1.0f}) {
    Floats v_tile(static_cast<std::size_t>(3 * padded(1)), 0.0f);
    Floats d_tile = v_tile;
    for (Index axis = 0; axis < 3; ++axis) {
      v_tile[static_cast<std::size_t>(axis * padded(1))] = v[axis];
      d_tile[static_cast<std::size_t>(axis * padded(1))] = sign * 4.0f * v[axis];
    }
    vn_relu(1, padded(1), tile_view<const float>(v_tile.data(), padded(1), 1),
            tile_view(d_tile.data(), padded(1), 1));
    for (Index axis = 0; axis < 3; ++axis) {
      const float got = d_tile[static_cast<std::size_t>(axis * padded(1))];
      if (sign > 0) {
        REQUIRE(got == v[axis]);
      } else {
        REQUIRE(std::abs(got) < 1e-6f);
      }
    }
  }
}

TEST_CASE("a zero direction changes nothing and divides by nothing") {
  Random random(13);
  const reference::Vectors v = random.vectors(5, 7);
  const Floats v_tile = to_tile(v);
  Floats d_tile(v_tile.size(), 0.0f);
  vn_relu(5, padded(7), tile_view(v_tile.data(), padded(7), 5),
          tile_view(d_tile.data(), padded(7), 5));
  REQUIRE(d_tile == v_tile);
}

TEST_CASE("the view of one shared feature serves all points") {
  Random random(14);
  const reference::Vectors m = random.vectors(1, 16);
  const reference::Vectors d = random.vectors(9, 16);
  const Floats m_tile = to_tile(m);
  Floats out = to_tile(d);
  const Index rows = padded(16);
  vn_relu(9, rows, {m_tile.data(), 0, rows}, tile_view(out.data(), rows, 9));
  reference::Vectors expanded(9, 16);
  for (Index p = 0; p < 9; ++p) {
    std::copy(m.values.begin(), m.values.end(), expanded.values.begin() + p * 48);
  }
  REQUIRE(tile_error(out.data(), reference::clip_to_half_space(expanded, d)) < 2e-6);
}

}  // namespace
}  // namespace vnreg::kernels::test
