#include "kernels/collect.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

TEST_CASE("collected rows equal the weighted mean of the rows within the radius") {
  Random random(81);
  for (const Index count : {1, 2, 7, 8, 9, 31, 64, 333}) {
    const std::vector<float> x = random.numbers(count), y = random.numbers(count),
                             z = random.numbers(count);
    for (const Index packets : {1, 2, 7, 8, 9, 16, 23}) {
      const Index length = packets * packet_size;
      const std::vector<float> rows = random.numbers(count * length);
      for (const float radius : {1e-3f, 0.8f, 10.0f}) {
        const Index self = random.integer(0, count - 1);
        std::vector<double> expected(static_cast<std::size_t>(length), 0.0);
        double total = 0;
        for (Index j = 0; j < count; ++j) {
          const auto a = static_cast<std::size_t>(j), b = static_cast<std::size_t>(self);
          const double dx = double{x[a]} - double{x[b]}, dy = double{y[a]} - double{y[b]},
                       dz = double{z[a]} - double{z[b]};
          const double root =
              std::max(0.0, 1 - (dx * dx + dy * dy + dz * dz) / (double{radius} * double{radius}));
          total += root * root;
          for (Index i = 0; i < length; ++i) {
            expected[static_cast<std::size_t>(i)] +=
                root * root * double{rows[static_cast<std::size_t>(j * length + i)]};
          }
        }
        CollectScratch scratch(count);
        GuardedFloats out(length);
        collect_rows({x.data(), y.data(), z.data()}, count, self, radius, rows.data(), length,
                     scratch, out.data());
        NormalisedError error;
        for (Index i = 0; i < length; ++i) {
          error.add(double{out.data()[i]}, expected[static_cast<std::size_t>(i)] / total);
        }
        CAPTURE(count, packets, radius);
        REQUIRE(error.value() < 5e-6);
        REQUIRE(out.intact());
      }
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
