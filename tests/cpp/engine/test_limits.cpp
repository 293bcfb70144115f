// A call ends when its time is up or when it is told to.
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <limits>
#include <thread>

#include "clouds.hpp"
#include "random_model.hpp"
#include "same_result.hpp"

namespace vnreg::test {
namespace {

struct Clouds {
  Random random{97};
  Points source = shape(1000, random);
  Points target = moved(shape(1000, random), random_motion(random, 1));
};

bool is_rigid(const Pose& pose) {
  const Eigen::Isometry3d m = motion_of(pose);
  return m.matrix().allFinite() && (m.linear() * m.linear().transpose()).isIdentity(1e-9);
}

TEST_CASE_METHOD(Clouds, "enough time changes nothing") {
  for (const Mode mode : {Mode::coarse, Mode::verified}) {
    Registrar plain(Model::builtin(), {.mode = mode, .threads = 1});
    Registrar limited(Model::builtin(), {.mode = mode, .threads = 1, .time_budget_ms = 60000});
    const Result expected = plain.align(source, target);
    check_same(limited.align(source, target), expected);
  }
}

TEST_CASE_METHOD(Clouds, "whatever the budget, a status and no pose or a rigid one") {
  for (const int threads : {1, 2}) {
    const Model model = Model::builtin();
    Registrar unlimited(model, {.threads = threads});
    double whole_ms = std::numeric_limits<double>::infinity();  // undisturbed, and warm
    for (int i = 0; i < 10; ++i) {
      whole_ms = std::min(whole_ms, unlimited.align(source, target).ms.total);
    }
    int timed_out = 0;
    const auto align_within = [&](double share) {
      Registrar registrar(model, {.threads = threads, .time_budget_ms = share * whole_ms});
      const Result& result = registrar.align(source, target);
      CAPTURE(share, threads, to_string(result.status), result.ms.total);
      if (result.status != Status::timed_out) return;
      ++timed_out;
      REQUIRE((!result.has_pose || is_rigid(result.T_target_source)));
      REQUIRE(std::isnan(result.confidence));
      REQUIRE(std::isnan(result.covariance[0]));
    };
    for (double share = 0.02; share < 0.97; share += 0.025) align_within(share);
    // That some ends find a pose, and some come too early for one: test_looks.cpp, which does not
    // depend on the time that a busy machine takes.
    REQUIRE(timed_out > 0);
  }
}

TEST_CASE_METHOD(Clouds, "a registrar is as good as new after a call that ran out of time") {
  const Model model = Model::builtin();
  const Result expected = Registrar(model, {.threads = 1}).align(source, target);
  Cancellation cancellation;
  Registrar registrar(model, {.threads = 1, .cancellation = &cancellation});
  cancellation.request();
  REQUIRE(registrar.align(source, target).status == Status::cancelled);
  cancellation.reset();
  check_same(registrar.align(source, target), expected);
}

TEST_CASE_METHOD(Clouds, "a cancelled call has no pose, in every mode and stage") {
  const Model models[] = {Model::builtin(), random_model().build()};
  for (const Model& model : models) {
    for (const Mode mode : {Mode::coarse, Mode::verified}) {
      Cancellation cancellation;
      Registrar registrar(model, {.mode = mode, .threads = 1, .cancellation = &cancellation});
      const double whole_ms = registrar.align(source, target).ms.total;
      for (const double share : {0.1, 0.4, 0.7}) {
        cancellation.reset();
        std::thread other([&] {
          std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(share * whole_ms));
          cancellation.request();
        });
        Status status = Status::ok;
        while (status != Status::cancelled) {
          const Result& result = registrar.align(source, target);
          status = result.status;
          REQUIRE(result.has_pose == (status != Status::cancelled));
        }
        other.join();
      }
    }
  }
}

TEST_CASE("a budget cuts a cloud of ten million points short") {
  const std::vector<std::array<float, 3>> many(10'000'000, {1, 2, 3});
  Registrar registrar(random_model().build(), {.threads = 1, .time_budget_ms = 2});
  const Result& result = registrar.align(many, many);
  REQUIRE(result.status == Status::timed_out);
  REQUIRE(!result.has_pose);
  REQUIRE(result.ms.total < 20);
}

TEST_CASE_METHOD(Clouds, "preparing keeps to the limits, too") {
  Cancellation cancellation;
  cancellation.request();
  Registrar registrar(Model::builtin(), {.threads = 1, .cancellation = &cancellation});
  REQUIRE(registrar.prepare(source).status() == Status::cancelled);
  cancellation.reset();
  REQUIRE(registrar.prepare(source).status() == Status::ok);
}

TEST_CASE("budgets that are none are refused") {
  const Model model = random_model().build();
  for (const double budget : {-1.0, -1e-9, 2e9, std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::quiet_NaN()}) {
    try {
      const Registrar registrar(model, {.time_budget_ms = budget});
      FAIL("accepted: " << budget);
    } catch (const Error& e) {
      REQUIRE(e.code() == ErrorCode::invalid_option);
      REQUIRE(e.field() == "time_budget_ms");
      REQUIRE(e.expected() == "0 to 1e9");
    }
  }
}

}  // namespace
}  // namespace vnreg::test
