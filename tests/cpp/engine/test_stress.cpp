// Many threads with one model, and cancellations at any moment. VNREG_STRESS_ALIGNS sets how many
// aligns each of the 8 threads makes; the default is for every day.
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"

namespace vnreg::test {
namespace {

constexpr int thread_count = 8;

int aligns_per_thread() {
  const char* text = std::getenv("VNREG_STRESS_ALIGNS");
  return text == nullptr ? 100 : std::atoi(text);
}

struct Case {
  Points source, target;
  Mode mode;
  Pose expected;
};

/// One registrar for each mode, as every thread has them.
struct Registrars {
  Registrar coarse, fine, verified;

  Registrars(const Model& paper, const Model& lean, const Cancellation* cancellation = nullptr)
      : coarse(paper, options(Mode::coarse, cancellation)),
        fine(paper, options(Mode::paper, cancellation)),
        verified(lean, options(Mode::verified, cancellation)) {}

  static Options options(Mode mode, const Cancellation* cancellation) {
    return {.mode = mode, .threads = 1, .max_points = 64, .cancellation = cancellation};
  }
  const Result& align(const Case& c) {
    Registrar& r = c.mode == Mode::coarse ? coarse : c.mode == Mode::paper ? fine : verified;
    return r.align(c.source, c.target);
  }
};

/// Pairs of all sizes and modes; one in 8 is of mode verified, which takes longest.
std::vector<Case> make_cases(const Model& paper, const Model& lean) {
  Random random(71);
  Registrars alone(paper, lean);
  std::vector<Case> cases;
  for (int i = 0; i < 16; ++i) {
    const auto count = static_cast<std::size_t>(random.uniform(0, 90));
    const Mode mode = i % 8 == 0 ? Mode::verified : i % 2 == 0 ? Mode::coarse : Mode::paper;
    cases.push_back({shape(count, random), shape(60, random), mode, identity_pose});
    cases.back().expected = alone.align(cases.back()).T_target_source;
  }
  return cases;
}

const Case& pick(const std::vector<Case>& cases, std::mt19937& random) {
  return cases[random() % cases.size()];
}

TEST_CASE("8 threads that share a model compute what one does") {
  const Model paper = random_model({.global = 8, .local = 8, .descriptor = 8}).build();
  const Model lean = random_descriptor_model({.vectors = 8, .scalars = 8}).build();
  const std::vector<Case> cases = make_cases(paper, lean);
  std::atomic<int> different{0}, done{0};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < thread_count; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      Registrars mine(paper, lean);
      for (int i = 0; i < aligns_per_thread(); ++i, ++done) {
        const Case& c = pick(cases, random);
        if (mine.align(c).T_target_source != c.expected) ++different;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  REQUIRE(done == thread_count * aligns_per_thread());
  REQUIRE(different == 0);
}

TEST_CASE("a storm of cancellations: cancelled or the same bits, and never anything else") {
  const Model paper = random_model({.global = 8, .local = 8, .descriptor = 8}).build();
  const Model lean = random_descriptor_model({.vectors = 8, .scalars = 8}).build();
  const std::vector<Case> cases = make_cases(paper, lean);
  Cancellation cancellation;
  std::atomic<int> different{0}, running{thread_count};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < thread_count; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      Registrars mine(paper, lean, &cancellation);
      for (int i = 0; i < aligns_per_thread(); ++i) {
        const Case& c = pick(cases, random);
        const Result& result = mine.align(c);
        if (result.status == Status::cancelled ? result.has_pose
                                               : result.T_target_source != c.expected) {
          ++different;
        }
      }
      --running;
    });
  }
  std::mt19937 random(99);
  while (running > 0) {
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
    random() % 2 == 0 ? cancellation.request() : cancellation.reset();
  }
  for (std::thread& thread : threads) thread.join();
  REQUIRE(different == 0);
}

}  // namespace
}  // namespace vnreg::test
