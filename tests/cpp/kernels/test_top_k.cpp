#include "kernels/top_k.hpp"

#include <limits>
#include <numeric>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

std::vector<std::uint32_t> run(const std::vector<float>& values, std::size_t k) {
  std::vector<std::uint64_t> scratch(values.size());
  std::vector<std::uint32_t> out(k);
  top_k(values, scratch, out);
  return out;
}

std::vector<std::uint32_t> naive(const std::vector<float>& values, std::size_t k) {
  std::vector<std::uint32_t> order(values.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return values[a] > values[b]; });
  order.resize(k);
  return order;
}

TEST_CASE("top k equals the stable descending sort") {
  Random random(71);
  for (const Index count : {1, 2, 3, 7, 63, 64, 65, 333, 1024}) {
    const std::vector<float> distinct = random.numbers(count);
    std::vector<float> tied(distinct);
    for (float& v : tied) v = std::round(v);
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}, distinct.size() / 6,
                                distinct.size() / 2, distinct.size()}) {
      CAPTURE(count, k);
      REQUIRE(run(distinct, k) == naive(distinct, k));
      REQUIRE(run(tied, k) == naive(tied, k));
    }
  }
}

TEST_CASE("minus zero equals zero, and infinities have their places") {
  constexpr float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> values{0.0f, -inf, -0.0f, inf, -1e-45f, 0.0f, 1e-45f};
  REQUIRE(run(values, 7) == std::vector<std::uint32_t>{3, 6, 0, 2, 5, 4, 1});
}

TEST_CASE("NaN among the values breaks nothing: every index appears once") {
  std::vector<float> values(65, std::numeric_limits<float>::quiet_NaN());
  values[7] = 1.0f;
  std::vector<std::uint32_t> got = run(values, 65);
  std::sort(got.begin(), got.end());
  for (std::uint32_t i = 0; i < 65; ++i) REQUIRE(got[i] == i);
}

}  // namespace
}  // namespace vnreg::kernels::test
