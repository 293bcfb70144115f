#include "kernels/mean_pool.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

TEST_CASE("sums per tile and their combination equal the mean over the cloud") {
  Random random(31);
  constexpr Index tile_points = 32;
  for (const Index channels : {1, 3, 5, 16, 47, 48, 128}) {
    for (const Index points : {1, 2, 3, 7, 31, 32, 33, 63, 64, 65, 333, 1024}) {
      const reference::Vectors v = random.vectors(points, channels);
      const Index rows = padded(channels);
      const Index tiles = (points + tile_points - 1) / tile_points;
      GuardedFloats sums(3 * rows * tiles);
      for (Index tile = 0; tile < tiles; ++tile) {
        const Index first = tile * tile_points;
        const Index width = std::min(tile_points, points - first);
        reference::Vectors part(width, channels);
        std::copy_n(v.values.begin() + first * channels * 3, width * channels * 3,
                    part.values.begin());
        sum_tile(to_tile(part).data(), rows, width, sums.data() + 3 * rows * tile);
      }
      GuardedFloats mean(3 * rows);
      mean_of_tiles(sums.data(), rows, tiles, points, mean.data());
      CAPTURE(channels, points);
      REQUIRE(sums.intact());
      REQUIRE(mean.intact());
      REQUIRE(tile_error(mean.data(), reference::mean(v)) < 2e-6);
    }
  }
}

TEST_CASE("a mean far from zero keeps its digits") {
  constexpr Index points = 4096;
  const Index rows = padded(1);
  reference::Vectors v(32, 1);
  for (double& x : v.values) x = 1000.25;
  Floats sums(static_cast<std::size_t>(3 * rows * points / 32));
  for (Index tile = 0; tile < points / 32; ++tile) {
    sum_tile(to_tile(v).data(), rows, 32, sums.data() + 3 * rows * tile);
  }
  Floats mean(static_cast<std::size_t>(3 * rows));
  mean_of_tiles(sums.data(), rows, points / 32, points, mean.data());
  REQUIRE(mean[0] == 1000.25f);
}

}  // namespace
}  // namespace vnreg::kernels::test
