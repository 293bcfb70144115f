#include "engine/deadline.hpp"

#include <catch2/catch.hpp>

namespace vnreg::test {
namespace {

TEST_CASE("a call whose cancellation is taken back while it runs was cancelled, not timed out") {
  Cancellation cancellation;
  detail::Deadline deadline;
  deadline.start({.cancellation = &cancellation});
  REQUIRE_FALSE(deadline.passed());
  cancellation.request();
  REQUIRE_FALSE(deadline.expired());  // nothing has looked
  REQUIRE(deadline.passed());
  cancellation.reset();
  REQUIRE(deadline.passed());
  REQUIRE(deadline.cancelled());
}

TEST_CASE("a call that ran out of time was not cancelled by what came later") {
  Cancellation cancellation;
  detail::Deadline deadline;
  deadline.start({.time_budget_ms = 1e-6, .cancellation = &cancellation});
  while (!deadline.passed()) {
  }
  cancellation.request();
  REQUIRE(deadline.passed());
  REQUIRE_FALSE(deadline.cancelled());
}

TEST_CASE("a new call knows nothing of the last one's end") {
  Cancellation cancellation;
  detail::Deadline deadline;
  cancellation.request();
  deadline.start({.cancellation = &cancellation});
  REQUIRE(deadline.passed());
  cancellation.reset();
  deadline.start({.cancellation = &cancellation});
  REQUIRE_FALSE(deadline.passed());
  REQUIRE_FALSE(deadline.cancelled());
}

}  // namespace
}  // namespace vnreg::test
