// After its construction a registrar allocates nothing. All ways to the heap are counted: see
// watched_heap.cpp.
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"
#include "watched_heap.hpp"

namespace vnreg::test {
namespace {

TEST_CASE("the counter counts") {
  const long before = heap::allocations();
  const auto number = std::make_unique<int>(1);
  const Eigen::VectorXf vector(1000);
  REQUIRE(*number == 1);
  REQUIRE(vector.size() == 1000);
  const long after = heap::allocations();
  REQUIRE(after >= before + 2);
}

TEST_CASE("align allocates nothing, with any input and any number of threads") {
  Random random(81);
  const Points source = shape(1000, random);
  const Points target = moved(shape(900, random), random_motion(random, 1));
  const Points many = shape(20000, random);
  const Points few = shape(24, random);
  const Points equal(100, {1, 2, 3});
  const Points none;
  for (const Widths& widths : {Widths{}, Widths{.global = 128, .local = 64},
                               Widths{.global = 48, .local = 48, .shared_direction = true}}) {
    const Model model = random_model(widths).build();
    for (const Mode mode : {Mode::coarse, Mode::paper}) {
      for (const int threads : {1, 2, 3}) {
        Registrar registrar(model, {.mode = mode, .threads = threads});
        const long before = heap::allocations();
        Status statuses[] = {
            registrar.align(source, target).status, registrar.align(many, target).status,
            registrar.align(few, many).status,      registrar.align(equal, source).status,
            registrar.align(none, source).status,   registrar.align(source, target).status,
        };
        const long after = heap::allocations();
        CAPTURE(widths.global, to_string(mode), threads);
        REQUIRE(after == before);
        REQUIRE(statuses[0] == Status::ok);
        REQUIRE(statuses[1] == Status::ok);
        REQUIRE(statuses[2] == Status::ok);
        REQUIRE(statuses[3] == Status::degenerate);
        REQUIRE(statuses[4] == Status::too_few_points);
      }
    }
  }
}

TEST_CASE("describing clouds allocates nothing") {
  Random random(82);
  const Points source = shape(1000, random), many = shape(5000, random), few = shape(24, random);
  const Model model = random_descriptor_model().build();
  for (const int threads : {1, 2, 3}) {
    Registrar registrar(model, {.mode = Mode::coarse, .threads = threads});
    const long before = heap::allocations();
    const Status statuses[] = {registrar.align(source, many).status,
                               registrar.align(few, source).status,
                               registrar.align(many, few).status};
    const long after = heap::allocations();
    CAPTURE(threads);
    REQUIRE(after == before);
    for (const Status status : statuses) REQUIRE(status == Status::ok);
  }
}

TEST_CASE("mode verified allocates nothing, with the shipped model") {
  Random random(83);
  const Points source = shape(1000, random), many = shape(5000, random), few = shape(24, random);
  const Points target = moved(shape(900, random), random_motion(random, 1));
  const Points equal(100, {1, 2, 3});
  const Points none;
  for (const int threads : {1, 2, 3}) {
    Registrar registrar(Model::builtin(), {.threads = threads});
    const long before = heap::allocations();
    const Result with_pose[] = {
        registrar.align(source, target), registrar.align(source, many),
        registrar.align(few, source),    registrar.align(many, few),
        registrar.align(source, source),
    };
    const Status without[] = {registrar.align(equal, source).status,
                              registrar.align(source, none).status};
    const long after = heap::allocations();
    CAPTURE(threads);
    REQUIRE(after == before);
    for (const Result& result : with_pose) REQUIRE(result.has_pose);
    REQUIRE(without[0] == Status::degenerate);
    REQUIRE(without[1] == Status::too_few_points);
  }
}

TEST_CASE("prepared clouds, batches and budgets allocate nothing while they align") {
  Random random(84);
  const Points source = shape(1000, random), many = shape(5000, random), few = shape(24, random);
  const Points target = moved(shape(900, random), random_motion(random, 1));
  const Model model = Model::builtin();
  Registrar registrar(model, {.threads = 2});
  Registrar limited(model, {.threads = 2, .time_budget_ms = 3});
  BatchRegistrar batch(model, {.threads = 2});
  const PreparedCloud prepared[] = {registrar.prepare(target), registrar.prepare(many),
                                    registrar.prepare(few), registrar.prepare(Points{})};
  const CloudPair pairs[] = {{source, target}, {many, few}, {few, source}};
  Result results[3];
  batch.align_many(pairs, results);  // the threads are made
  const long before = heap::allocations();
  for (const PreparedCloud& cloud : prepared) {
    registrar.align(source, cloud);
    registrar.align(cloud, prepared[0]);
    limited.align(cloud, few);
    const CloudPair to_prepared[] = {{source, cloud}, {few, cloud}, {cloud, many}};
    batch.align_many(to_prepared, results);
  }
  batch.align_many(pairs, results);
  const long after = heap::allocations();
  REQUIRE(after == before);
  for (const Result& result : results) REQUIRE(result.has_pose);
}

}  // namespace
}  // namespace vnreg::test
