#include "kernels/collect.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

struct Cloud {
  std::vector<float> x, y, z;

  Cloud(Index count, Random& random)
      : x(random.numbers(count)), y(random.numbers(count)), z(random.numbers(count)) {}
  Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
};

/// The weighted mean of the rows about point `self`.
std::vector<double> naive_rows(const Cloud& cloud, std::size_t self, float radius,
                               const std::vector<float>& rows, std::size_t length) {
  std::vector<double> sums(length, 0.0);
  double total = 0;
  for (std::size_t j = 0; j < cloud.x.size(); ++j) {
    const double dx = double{cloud.x[j]} - double{cloud.x[self]};
    const double dy = double{cloud.y[j]} - double{cloud.y[self]};
    const double dz = double{cloud.z[j]} - double{cloud.z[self]};
    const double root =
        std::max(0.0, 1 - (dx * dx + dy * dy + dz * dz) / (double{radius} * double{radius}));
    total += root * root;
    for (std::size_t i = 0; i < length; ++i) sums[i] += root * root * double{rows[j * length + i]};
  }
  for (double& sum : sums) sum /= total;
  return sums;
}

TEST_CASE("collected rows equal the weighted means of the rows within the radius") {
  Random random(81);
  for (const Index count : {1, 2, 7, 8, 9, 31, 64, 333}) {
    const Cloud cloud(count, random);
    for (const Index packets : {1, 2, 7, 8, 23}) {
      const Index length = packets * packet_size;
      const std::vector<float> rows = random.numbers(count * length);
      for (const float radius : {1e-3f, 0.8f, 10.0f}) {
        const Index first = random.integer(0, count - 1);
        const Index width = random.integer(1, std::min<Index>(count - first, 37));
        CollectScratch scratch(count);
        GuardedFloats out(width * length);
        collect_rows(cloud.coordinates(), count, first, width, radius, rows.data(), length, scratch,
                     out.data());
        CAPTURE(count, packets, radius, first, width);
        REQUIRE(out.intact());
        for (Index p = 0; p < width; ++p) {
          const std::vector<double> expected =
              naive_rows(cloud, static_cast<std::size_t>(first + p), radius, rows,
                         static_cast<std::size_t>(length));
          NormalisedError error;
          for (Index i = 0; i < length; ++i) {
            error.add(double{out.data()[p * length + i]}, expected[static_cast<std::size_t>(i)]);
          }
          REQUIRE(error.value() < 5e-6);
        }
      }
    }
  }
}

TEST_CASE("a point has the same row in whatever tile it is collected") {
  Random random(82);
  constexpr Index count = 200, length = 3 * packet_size;
  const Cloud cloud(count, random);
  const std::vector<float> rows = random.numbers(count * length);
  CollectScratch scratch(count);
  std::vector<float> whole(static_cast<std::size_t>(count * length)), part(whole.size());
  collect_rows(cloud.coordinates(), count, 0, count, 0.9f, rows.data(), length, scratch,
               whole.data());
  for (const Index tile : {1, 3, 32}) {
    for (Index first = 0; first < count; first += tile) {
      collect_rows(cloud.coordinates(), count, first, std::min(tile, count - first), 0.9f,
                   rows.data(), length, scratch, part.data() + first * length);
    }
    CAPTURE(tile);
    NormalisedError error;
    for (std::size_t i = 0; i < whole.size(); ++i) error.add(double{part[i]}, double{whole[i]});
    REQUIRE(error.value() < 1e-6);
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
