// Between two looks at the clock a call does little: that is by how much it may overrun its budget.
// The clock that the deadline reads is replaced here by one that measures the processor's time
// since it was read last, which other processes do not change, and that can be put forward at a
// chosen look.
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "clouds.hpp"
#include "random_model.hpp"
#include "same_result.hpp"

namespace {

double work_ms(clockid_t clock, timespec* time) {
  syscall(SYS_clock_gettime, clock, time);
  return static_cast<double>(time->tv_sec) * 1e3 + static_cast<double>(time->tv_nsec) * 1e-6;
}

struct Looks {
  bool counting = false;
  long count = 0;
  double last_ms = 0;
  double piece_ms = 0;    // between the last two looks
  double longest_ms = 0;  // two pieces together: the stopwatch between them looks, too
  long late_from = std::numeric_limits<long>::max();  // the look that finds the time spent
} looks;

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (clock == CLOCK_MONOTONIC && looks.counting) {
    const double now_ms = work_ms(CLOCK_THREAD_CPUTIME_ID, time);
    const double piece_ms = looks.count++ > 0 ? now_ms - looks.last_ms : 0;
    looks.longest_ms = std::max(looks.longest_ms, looks.piece_ms + piece_ms);
    looks.piece_ms = piece_ms;
    looks.last_ms = work_ms(CLOCK_THREAD_CPUTIME_ID, time);
  }
  const auto done = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (clock == CLOCK_MONOTONIC && looks.counting && looks.count > looks.late_from) {
    time->tv_sec += 1'000'000;
  }
  return done;
}

namespace vnreg::test {
namespace {

/// The most work between two looks, the least of five calls.
double longest_between_looks_ms(Registrar& registrar, const Points& source, const Points& target) {
  double least = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < 5; ++repeat) {
    looks = {.counting = true};
    const Result& result = registrar.align(source, target);
    looks.counting = false;
    REQUIRE(result.has_pose);
    REQUIRE(looks.count > 50);
    least = std::min(least, looks.longest_ms);
  }
  return least;
}

TEST_CASE("every mode looks at the clock every millisecond") {
  Random random(101);
  const Eigen::Isometry3d motion = random_motion(random, 1);
  const Model models[] = {Model::builtin(), random_model().build()};
  for (const std::size_t points : {1024u, 4096u, 16384u}) {
    // The source has to be subsampled, too.
    const Points source = shape(2 * points, random), target = moved(shape(points, random), motion);
    for (const Model& model : models) {
      for (const Mode mode : {Mode::coarse, Mode::verified}) {
        Registrar registrar(model, {.mode = mode,
                                    .threads = 1,
                                    .max_points = static_cast<int>(points),
                                    .time_budget_ms = 1e6});
        const double longest = longest_between_looks_ms(registrar, source, target);
        CAPTURE(points, model.name(), to_string(mode));
        CHECK(longest < 1.0);
      }
    }
  }
}

TEST_CASE("a call that finds its time spent, at whatever look, says so or leaves nothing out") {
  Random random(103);
  const Eigen::Isometry3d motion = random_motion(random, 1);
  const Points source = shape(600, random), target = moved(shape(600, random), motion);
  const Points other = shape(600, random);
  const Model models[] = {Model::builtin(), random_model().build()};
  for (const Model& model : models) {
    Registrar registrar(model, {.threads = 1, .time_budget_ms = 1e6});
    looks = {.counting = true};
    const Result expected = registrar.align(source, target);
    looks.counting = false;
    const long all = looks.count;
    int cut_short = 0, with_pose = 0;
    for (long late = 1; late <= all; late += late < all - 40 ? 11 : 1) {
      registrar.align(other, other);  // nothing that is left in memory shall serve
      looks = {.counting = true, .late_from = late};
      const Result& result = registrar.align(source, target);
      looks.counting = false;
      CAPTURE(model.name(), late, all);
      if (result.status == Status::timed_out) {
        ++cut_short;
        with_pose += result.has_pose;
        CHECK(result.overlap == 0);
        CHECK(std::isnan(result.confidence));
      } else {
        check_same(result, expected);
      }
    }
    CHECK(cut_short > with_pose + 10);  // some too early for a pose
    CHECK(with_pose > 0);
  }
}

}  // namespace
}  // namespace vnreg::test
