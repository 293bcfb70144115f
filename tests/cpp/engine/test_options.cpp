#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

void refused(const Model& model, const Options& options, const std::string& field) {
  try {
    const Registrar registrar(model, options);
  } catch (const Error& e) {
    REQUIRE(e.code() == ErrorCode::invalid_option);
    REQUIRE(e.field() == field);
    return;
  }
  FAIL("accepted: " << field);
}

TEST_CASE("options out of range are refused by name") {
  const Model model = random_model().build();
  for (const int threads : {-1, -2147483647, 1025}) refused(model, {.threads = threads}, "threads");
  for (const int points : {-1, 1, 63, 16385}) refused(model, {.max_points = points}, "max_points");
  refused(model, {.mode = static_cast<Mode>(7)}, "mode");
  refused(random_model({.keep_divisor = 40}).build(), {.max_points = 119}, "max_points");
  REQUIRE_NOTHROW(Registrar(random_model({.keep_divisor = 40}).build(), {.max_points = 120}));
  REQUIRE_NOTHROW(Registrar(model, {.threads = 1, .max_points = 64}));
  REQUIRE_NOTHROW(
      Registrar(random_model({.global = 4, .local = 4}).build(), {.max_points = 16384}));
}

TEST_CASE("a model without a fine register runs the other modes") {
  const Model model = random_model({.fine_iterations = 0}).build();
  refused(model, {.mode = Mode::paper}, "mode");
  Random random(71);
  const Points cloud = shape(100, random);
  for (const Mode mode : {Mode::coarse, Mode::verified}) {
    REQUIRE(Registrar(model, {.mode = mode}).align(cloud, cloud).has_pose);
  }
}

TEST_CASE("verified is the default mode") {
  Random random(76);
  const Points source = shape(200, random);
  const Points target = moved(shape(200, random), random_motion(random, 1));
  const Model model = random_model().build();
  Registrar plain(model);
  Registrar verified(model, {.mode = Mode::verified});
  REQUIRE(plain.align(source, target).T_target_source ==
          verified.align(source, target).T_target_source);
  REQUIRE(plain.align(source, target).score > 0);
}

TEST_CASE("the coarse mode is the first half of the paper mode") {
  const Model model = random_model().build();
  Random random(72);
  const Points source = shape(200, random);
  const Points target = moved(shape(200, random), random_motion(random, 1));
  Registrar coarse(model, {.mode = Mode::coarse});
  Registrar paper(model, {.mode = Mode::paper});
  const Result& half = coarse.align(source, target);
  const Result& whole = paper.align(source, target);
  REQUIRE(half.T_target_source == whole.T_target_source_coarse);
  REQUIRE(whole.T_target_source != whole.T_target_source_coarse);
  REQUIRE(half.ms.fine == 0);
}

TEST_CASE("the points used follow max_points and the model") {
  Random random(73);
  const Points cloud = shape(2000, random);
  const Points few = shape(70, random);
  Registrar by_model(random_model({.points = 128}).build());
  REQUIRE(by_model.align(cloud, few).points_source == 128);
  REQUIRE(by_model.align(cloud, few).points_target == 70);
  Registrar by_option(random_model({.points = 128}).build(),
                      {.mode = Mode::paper, .max_points = 1500});
  REQUIRE(by_option.align(cloud, few).points_source == 1500);
}

TEST_CASE("times add up") {
  Random random(74);
  const Points cloud = shape(300, random);
  Registrar registrar(random_model().build(), {.mode = Mode::paper, .threads = 1});
  const Result& r = registrar.align(cloud, cloud);
  for (const double ms : {r.ms.prepare, r.ms.encode, r.ms.coarse, r.ms.fine, r.ms.measure}) {
    REQUIRE(ms > 0);
  }
  const double sum = r.ms.prepare + r.ms.encode + r.ms.coarse + r.ms.fine + r.ms.measure;
  REQUIRE(sum <= r.ms.total);
  const Result& none = registrar.align(Points{}, cloud);
  REQUIRE(none.ms.encode == 0);
  REQUIRE(none.ms.total > 0);
}

TEST_CASE("the words of the API") {
  REQUIRE(to_string(Mode::coarse) == "coarse");
  REQUIRE(to_string(Mode::paper) == "paper");
  REQUIRE(to_string(Mode::verified) == "verified");
  REQUIRE(to_string(Status::ok) == "ok");
  REQUIRE(to_string(Status::low_confidence) == "low_confidence");
  REQUIRE(to_string(Status::too_few_points) == "too_few_points");
  REQUIRE(to_string(Status::scales_differ) == "scales_differ");
  REQUIRE(to_string(Status::not_finite) == "not_finite");
  REQUIRE(to_string(Status::degenerate) == "degenerate");
  REQUIRE(to_string(Status::ambiguous) == "ambiguous");
  REQUIRE(to_string(Status::timed_out) == "timed_out");
  REQUIRE(to_string(Status::cancelled) == "cancelled");
  REQUIRE(to_string(static_cast<Status>(99)) == "unknown");
  REQUIRE(to_string(static_cast<Mode>(99)) == "unknown");
  REQUIRE(version() == VNREG_EXPECTED_VERSION);
  REQUIRE(instruction_set() == VNREG_EXPECTED_ISA);
}

TEST_CASE("the built-in model aligns, or says that the library was built without one") {
  Random random(75);
  const Points source = shape(500, random);
  const Eigen::Isometry3d truth = random_motion(random, 1);
  const Points target = moved(source, truth);
  try {
    const Result result = align(source, target);
    REQUIRE(result.has_pose);
    REQUIRE(rotation_error_deg(motion_of(result.T_target_source_coarse), truth) < 1);
  } catch (const Error& e) {
    REQUIRE(e.code() == ErrorCode::file_unreadable);
    REQUIRE(e.field() == "built-in model");
    REQUIRE(!VNREG_EXPECT_BUILTIN_MODEL);
  }
}

}  // namespace
}  // namespace vnreg::test
