// Batches: the results of single calls, whatever the number of threads.
#include <catch2/catch.hpp>

#include "clouds.hpp"
#include "random_model.hpp"
#include "same_result.hpp"

namespace vnreg::test {
namespace {

struct Batch {
  Random random{99};
  Points target = shape(200, random);
  std::vector<Points> sources;
  std::vector<CloudPair> pairs;
  std::vector<Result> expected;
  Model model = random_model().build();

  Batch() {
    Registrar registrar(model, {.threads = 1});
    for (std::size_t i = 0; i < 9; ++i) {
      sources.push_back(moved(shape(20 + 30 * i, random), random_motion(random, 1)));
    }
    for (const Points& source : sources) {
      pairs.push_back({source, target});
      expected.push_back(registrar.align(source, target));
    }
  }
};

TEST_CASE_METHOD(Batch, "a batch gives what single calls give") {
  for (const int threads : {1, 2, 3}) {
    BatchRegistrar batch(model, {.threads = threads});
    std::vector<Result> results(pairs.size());
    for (int repeat = 0; repeat < 2; ++repeat) {
      batch.align_many(pairs, results);
      for (std::size_t i = 0; i < pairs.size(); ++i) check_same(results[i], expected[i]);
    }
  }
  REQUIRE(expected[0].status == Status::too_few_points);
  REQUIRE(expected[8].has_pose);
}

TEST_CASE_METHOD(Batch, "many sources to one prepared target") {
  Registrar single(model, {.threads = 1});
  const PreparedCloud by_single = single.prepare(target);
  BatchRegistrar batch(model, {.threads = 2});
  const PreparedCloud prepared = batch.prepare(target);
  std::vector<CloudPair> to_prepared;
  for (const Points& source : sources) to_prepared.push_back({source, prepared});
  std::vector<Result> results(sources.size());
  batch.align_many(to_prepared, results);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    check_same(results[i], single.align(sources[i], by_single));
  }
}

TEST_CASE_METHOD(Batch, "the shorter span decides") {
  BatchRegistrar batch(model, {.threads = 2});
  std::vector<Result> few(3), many(20);
  many.back().points_source = 7;
  batch.align_many(pairs, few);
  batch.align_many(pairs, many);
  batch.align_many({}, many);
  for (std::size_t i = 0; i < 3; ++i) check_same(few[i], expected[i]);
  check_same(many[8], expected[8]);
  REQUIRE(many.back().points_source == 7);
}

TEST_CASE_METHOD(Batch, "a cancelled batch says so of every pair that is left") {
  Cancellation cancellation;
  BatchRegistrar batch(model, {.threads = 2, .cancellation = &cancellation});
  std::vector<Result> results(pairs.size());
  cancellation.request();
  batch.align_many(pairs, results);
  for (const Result& result : results) REQUIRE(result.status == Status::cancelled);
}

TEST_CASE_METHOD(Batch, "the free function uses the built-in model") {
  const std::vector<Result> results = align_many(pairs, {.threads = 2});
  REQUIRE(results.size() == pairs.size());
  check_same(results[8], align(sources[8], target));
  REQUIRE(align_many({}).empty());
}

TEST_CASE_METHOD(Batch, "a batch refuses the options that it cannot honour") {
  REQUIRE_THROWS_WITH(BatchRegistrar(model, {.record_stages = true}),
                      "record_stages: expected false in a batch, got true");
  REQUIRE_THROWS_WITH(BatchRegistrar(model, {.threads = -1}),
                      "threads: expected 0 or 1 to 1024, got -1");
  REQUIRE_THROWS_WITH(BatchRegistrar(model, {.threads = 2000}),
                      "threads: expected 0 or 1 to 1024, got 2000");
}

}  // namespace
}  // namespace vnreg::test
