#include "kernels/list_within.hpp"

#include <limits>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

TEST_CASE("numbers within a limit are listed in order, equal ones too, NaN never") {
  Random random(161);
  for (const Index count : {0, 16, 32, 48, 160}) {
    for (const float limit : {-10.0f, -0.5f, 0.0f, 1.0f, 10.0f}) {
      std::vector<float> values = random.numbers(count);
      for (Index i = 0; i < count; i += 7) values[static_cast<std::size_t>(i)] = limit;
      for (Index i = 3; i < count; i += 11) {
        values[static_cast<std::size_t>(i)] = std::numeric_limits<float>::quiet_NaN();
      }
      std::vector<Index> expected, listed;
      for (Index i = 0; i < count; ++i) {
        if (values[static_cast<std::size_t>(i)] <= limit) expected.push_back(i);
      }
      for_each_within(values.data(), count, limit, [&](Index i) { listed.push_back(i); });
      CAPTURE(count, limit);
      REQUIRE(listed == expected);
    }
  }
}

TEST_CASE("the list made without branches is the same, for any count") {
  Random random(162);
  for (const Index count : {0, 1, 7, 255, 256, 257, 700}) {
    for (const float limit : {-10.0f, 0.0f, 10.0f}) {
      std::vector<float> values = random.numbers(count);
      for (Index i = 0; i < count; i += 5) values[static_cast<std::size_t>(i)] = limit;
      for (Index i = 3; i < count; i += 11) {
        values[static_cast<std::size_t>(i)] = std::numeric_limits<float>::quiet_NaN();
      }
      std::vector<Index> expected, listed;
      for (Index i = 0; i < count; ++i) {
        if (values[static_cast<std::size_t>(i)] <= limit) expected.push_back(i);
      }
      for_each_listed(values.data(), count, limit, [&](Index i) { listed.push_back(i); });
      CAPTURE(count, limit);
      REQUIRE(listed == expected);
    }
  }
}

}  // namespace
}  // namespace vnreg::kernels::test
