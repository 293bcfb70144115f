#include "kernels/oriented_points.hpp"

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

TEST_CASE("gathered points are the records they name, for any number of them") {
  Random random(141);
  constexpr Index points = 67;
  Floats records(static_cast<std::size_t>(points * oriented_point_size));
  for (float& v : records) v = random.normal();
  for (const Index count : {0, 1, 3, 4, 7, 8, 9, 15, 16, 31, 64, 65}) {
    std::vector<std::uint16_t> places;
    for (Index i = 0; i < count; ++i) {
      places.push_back(static_cast<std::uint16_t>(random.integer(0, points - 1)));
    }
    std::vector<GuardedFloats> numbers(6, GuardedFloats(count));
    gather_points(records.data(), places.data(), count,
                  {numbers[0].data(), numbers[1].data(), numbers[2].data(), numbers[3].data(),
                   numbers[4].data(), numbers[5].data()});
    CAPTURE(count);
    for (std::size_t k = 0; k < 6; ++k) {
      REQUIRE(numbers[k].intact());
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        const std::size_t place = static_cast<std::size_t>(oriented_point_size) * places[i] + k;
        REQUIRE(numbers[k].data()[i] == records[place]);
      }
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
