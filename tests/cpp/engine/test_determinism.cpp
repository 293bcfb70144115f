// The same input gives the same bits, whatever the number of threads and whatever came before.
#include <catch2/catch.hpp>
#include <thread>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

struct Answer {
  Pose pose, coarse;
  double overlap, rmse, inlier_distance;
  std::vector<std::vector<double>> stages;
  friend bool operator==(const Answer&, const Answer&) = default;
};

Answer ask(Registrar& registrar, const Points& source, const Points& target) {
  const Result& r = registrar.align(source, target);
  REQUIRE(r.has_pose);
  Answer answer{
      r.T_target_source, r.T_target_source_coarse, r.overlap, r.rmse, r.inlier_distance, {}};
  for (const Stage& s : registrar.stages()) answer.stages.push_back(s.values);
  return answer;
}

TEST_CASE("the number of threads changes no bit of any stage") {
  const Model model = random_model({.global = 16, .local = 12, .neighbours = 20}).build();
  Random random(41);
  for (const std::size_t count : {33u, 333u, 1024u}) {
    const Points source = shape(count, random);
    const Points target = moved(shape(count + 7, random), random_motion(random, 1));
    Registrar one(model, {.mode = Mode::paper, .threads = 1, .record_stages = true});
    const Answer expected = ask(one, source, target);
    for (const int threads : {2, 3, 8, 0}) {
      Registrar several(model, {.mode = Mode::paper, .threads = threads, .record_stages = true});
      for (int repeat = 0; repeat < 3; ++repeat) {
        CAPTURE(count, threads, repeat);
        REQUIRE(ask(several, source, target) == expected);
      }
    }
  }
}

TEST_CASE("what a registrar did before does not matter") {
  const Model model = random_model().build();
  Random random(42);
  const Points source = shape(200, random);
  const Points target = shape(150, random);
  Registrar fresh(model, {.mode = Mode::paper, .record_stages = true});
  const Answer expected = ask(fresh, source, target);
  Registrar used(model, {.mode = Mode::paper, .record_stages = true});
  used.align(shape(1024, random), shape(1000, random));
  used.align(Points(100, {1, 1, 1}), target);
  used.align(moved(source, Eigen::Isometry3d::Identity(), 1e200), Points(10));
  REQUIRE(ask(used, source, target) == expected);
}

TEST_CASE("recording stages and the shared model change nothing") {
  const Model model = random_model().build();
  Random random(43);
  const Points source = shape(200, random);
  const Points target = shape(150, random);
  Registrar plain(model, {.mode = Mode::paper});
  Registrar recording(model, {.mode = Mode::paper, .record_stages = true});
  REQUIRE(plain.align(source, target).T_target_source ==
          recording.align(source, target).T_target_source);
}

TEST_CASE("one registrar per thread, one model for all") {
  const Model model = random_model().build();
  Random random(44);
  const Points source = shape(200, random);
  const Points target = shape(150, random);
  Registrar alone(model, {.mode = Mode::paper, .threads = 1});
  const Pose expected = alone.align(source, target).T_target_source;
  Pose poses[4];
  std::vector<std::thread> threads;
  for (Pose& pose : poses) {
    threads.emplace_back([&pose, &model, &source, &target] {
      Registrar registrar(model, {.mode = Mode::paper, .threads = 2});
      for (int i = 0; i < 5; ++i) pose = registrar.align(source, target).T_target_source;
    });
  }
  for (std::thread& t : threads) t.join();
  for (const Pose& pose : poses) REQUIRE(pose == expected);
}

TEST_CASE("a moved registrar goes on where it was") {
  const Model model = random_model().build();
  Random random(45);
  const Points source = shape(200, random);
  const Points target = shape(150, random);
  Registrar first(model, {.mode = Mode::paper});
  const Pose expected = first.align(source, target).T_target_source;
  Registrar second(std::move(first));
  REQUIRE(second.align(source, target).T_target_source == expected);
  Registrar third(model, {.mode = Mode::coarse});
  third = std::move(second);
  REQUIRE(third.align(source, target).T_target_source == expected);
}

}  // namespace
}  // namespace vnreg::test
