// Of a large cloud a surface takes some points only. If all of these coincide it determines no
// rotation, though the cloud has other points too.
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

// Another place is another rounding of the answer, but no other code: a sanitizer, under which it
// takes 3 s, sees nothing new.
#ifdef VNREG_SANITIZED
constexpr int places = 3;
#else
constexpr int places = 30;
#endif

TEST_CASE("a surface whose points coincide is refused, wherever they are") {
  Random random(217);
  const Points body = shape(200, random);
  for (int i = 0; i < places; ++i) {
    Points heap(12000, {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)});
    heap.push_back(body[static_cast<std::size_t>(i)]);
    CAPTURE(i);
    REQUIRE(!PreparedPair(heap, body).built());
    REQUIRE(!PreparedPair(body, heap).built());
  }
}

}  // namespace
}  // namespace vnreg::test
