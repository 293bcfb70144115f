// A prepared cloud changes the time that an alignment takes, and what it says only where promised.
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"
#include "same_result.hpp"

namespace vnreg::test {
namespace {

struct Pair {
  Random random{95};
  Points small = shape(300, random);
  Eigen::Isometry3d truth = random_motion(random, 1);
  Points large = moved(shape(260, random), truth, 1.1);
};

Model shipped() {
  static const Model model = Model::builtin();
  return model;
}

TEST_CASE_METHOD(Pair, "the larger cloud prepared: the same bits, on either side, in every mode") {
  const Model models[] = {random_model().build(), random_descriptor_model().build(), shipped()};
  for (const Model& model : models) {
    const bool fine = &model == &models[0];
    for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
      if (mode == Mode::paper && !fine) continue;
      for (const int threads : {1, 2}) {
        Registrar registrar(model, {.mode = mode, .threads = threads});
        const Result forward = registrar.align(small, large);
        const Result backward = registrar.align(large, small);
        const PreparedCloud prepared = registrar.prepare(large);
        CAPTURE(model.name(), to_string(mode), threads);
        REQUIRE(forward.has_pose);
        REQUIRE(prepared.status() == Status::ok);
        REQUIRE(prepared.size() == large.size());
        for (int repeat = 0; repeat < 2; ++repeat) {
          check_same(registrar.align(small, prepared), forward);
          check_same(registrar.align(prepared, small), backward);
        }
      }
    }
  }
}

TEST_CASE_METHOD(Pair, "where coordinates are taken as given, surfaces still share one unit") {
  Registrar registrar(random_model({.rms_radius = 0}).build(), {.threads = 1});
  const Result expected = registrar.align(small, large);
  const PreparedCloud source = registrar.prepare(small), target = registrar.prepare(large);
  check_same(registrar.align(source, target), expected);
  check_same(registrar.align(small, target), expected);
}

TEST_CASE_METHOD(Pair, "radii that differ by rounding alone") {
  Registrar registrar(shipped(), {.threads = 1});
  const Points turned = moved(small, truth);
  const Result expected = registrar.align(small, turned);
  const PreparedCloud source = registrar.prepare(small), target = registrar.prepare(turned);
  check_same(registrar.align(source, target), expected);
}

TEST_CASE_METHOD(Pair, "two prepared clouds give the bits of their points") {
  Registrar registrar(shipped(), {.threads = 1});
  const Result expected = registrar.align(small, large);
  const PreparedCloud source = registrar.prepare(small), target = registrar.prepare(large);
  check_same(registrar.align(source, target), expected);
  const Result itself = registrar.align(small, small);
  check_same(registrar.align(source, source), itself);
}

TEST_CASE_METHOD(Pair, "a slightly larger cloud is measured in the prepared one's unit") {
  Registrar registrar(shipped(), {.threads = 1});
  const Points one = shape(1000, random), other = moved(shape(1000, random), truth);
  for (const auto& [source, target] : {std::pair(one, other), std::pair(other, one)}) {
    const Result& result = registrar.align(source, registrar.prepare(target));
    const Eigen::Isometry3d pose = motion_of(result.T_target_source);
    const bool forward = source == one;
    REQUIRE(rotation_error_deg(pose, forward ? truth : truth.inverse()) < 5);
  }
}

TEST_CASE_METHOD(Pair, "a much larger cloud has the last word") {
  Registrar registrar(shipped(), {.threads = 1});
  const Points huge = moved(large, Eigen::Isometry3d::Identity(), 1.5);
  const Result expected = registrar.align(huge, small);
  check_same(registrar.align(huge, registrar.prepare(small)), expected);
}

TEST_CASE_METHOD(Pair, "another registrar takes the points") {
  Registrar maker(shipped(), {.mode = Mode::coarse, .threads = 1});
  Registrar user(shipped(), {.threads = 1});
  const PreparedCloud prepared = maker.prepare(large);
  const Result expected = user.align(small, large);
  check_same(user.align(small, prepared), expected);
  Registrar seeded(shipped(), {.threads = 1, .seed = 5});
  const Result other = seeded.align(small, large);
  check_same(seeded.align(small, prepared), other);
}

TEST_CASE_METHOD(Pair, "it outlives its registrar and may be copied") {
  Registrar user(shipped(), {.threads = 1});
  const Result expected = user.align(small, large);
  const PreparedCloud prepared = Registrar(shipped(), {.threads = 1}).prepare(large);
  const PreparedCloud copy = prepared;
  check_same(user.align(small, copy), expected);
}

TEST_CASE_METHOD(Pair, "what has no pose says so") {
  Registrar registrar(shipped(), {.threads = 1});
  Points broken = large;
  broken[3][1] = std::numeric_limits<double>::infinity();
  const std::pair<Points, Status> cases[] = {{Points{}, Status::too_few_points},
                                             {Points(100, {1, 2, 3}), Status::degenerate},
                                             {broken, Status::not_finite}};
  for (const auto& [points, status] : cases) {
    const PreparedCloud prepared = registrar.prepare(points);
    REQUIRE(prepared.status() == status);
    REQUIRE(registrar.align(small, prepared).status == status);
    REQUIRE(registrar.align(prepared, small).status == status);
    REQUIRE(!registrar.align(small, prepared).has_pose);
    Registrar other(random_model().build());
    REQUIRE(other.align(small, prepared).status == status);
  }
  REQUIRE(registrar.align(small, large).has_pose);
}

TEST_CASE_METHOD(Pair, "preparing leaves the last result as it is") {
  Registrar registrar(shipped(), {.threads = 1, .record_stages = true});
  const Result& result = registrar.align(small, large);
  const Result copy = result;
  registrar.prepare(small);
  check_same(result, copy);
}

}  // namespace
}  // namespace vnreg::test
