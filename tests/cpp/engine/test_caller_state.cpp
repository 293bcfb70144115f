// A call gives the processor back as it found it.
#include <catch2/catch.hpp>
#include <cmath>

#include "clouds.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::test {
namespace {

TEST_CASE("a call leaves the caller's long double alone") {
  Random random(301);
  const Points source = shape(600, random);
  const Points target = moved(shape(600, random), random_motion(random, 1));
  for (const Mode mode : {Mode::coarse, Mode::verified}) {
    Registrar registrar(Model::builtin(), {.mode = mode, .threads = 1});
    registrar.align(source, target);
    // Its registers are those of MMX, in use until they are given back: then every number is NaN.
    volatile long double eight = 8;
    REQUIRE(static_cast<double>(std::sqrt(eight) * std::sqrt(eight)) == Approx(8));
  }
}

}  // namespace
}  // namespace vnreg::test
