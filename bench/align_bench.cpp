// Milliseconds per pair of the whole registration and of its stages, with random weights.
//
//   align_bench                     all configurations, median of 31 runs each
//   align_bench --benchmark_filter=paper/threads:1
//
// Each line is C / L / points / threads; the counters are the stages of Result::ms.
#include <benchmark/benchmark.h>

#include <string>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

struct Configuration {
  const char* name;
  Widths widths;
};

const Configuration configurations[] = {
    {"paper",
     {.global = 128,
      .local = 64,
      .descriptor = 64,
      .pair = 32,
      .significance = {64, 32},
      .neighbours = 20}},
    {"width48",
     {.global = 48,
      .local = 48,
      .descriptor = 64,
      .pair = 32,
      .significance = {64, 32},
      .neighbours = 20}},
    {"width32",
     {.global = 32,
      .local = 32,
      .descriptor = 32,
      .pair = 32,
      .significance = {64, 32},
      .neighbours = 20}},
};

void align_pair(benchmark::State& state, const Widths& widths, Mode mode, std::size_t points,
                int threads) {
  Random random(1);
  const Points source = shape(points, random);
  const Points target = moved(shape(points, random), random_motion(random, 1));
  Registrar registrar(random_model(widths).build(),
                      {.mode = mode, .threads = threads, .max_points = static_cast<int>(points)});
  registrar.align(source, target);
  StageTimes ms;
  for (auto _ : state) ms = registrar.align(source, target).ms;
  state.counters["prepare"] = ms.prepare;
  state.counters["encode"] = ms.encode;
  state.counters["coarse"] = ms.coarse;
  state.counters["fine"] = ms.fine;
  state.counters["measure"] = ms.measure;
  state.counters["total"] = ms.total;
}

void add(const Configuration& c, Mode mode, std::size_t points, int threads) {
  const std::string name = std::string(c.name) + "/" + std::string(to_string(mode)) +
                           "/points:" + std::to_string(points) +
                           "/threads:" + std::to_string(threads);
  benchmark::RegisterBenchmark(name.c_str(),
                               [=, widths = c.widths](benchmark::State& state) {
                                 align_pair(state, widths, mode, points, threads);
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->Iterations(1)
      ->Repetitions(31)
      ->ReportAggregatesOnly();
}

}  // namespace
}  // namespace vnreg::test

int main(int argc, char** argv) {
  using namespace vnreg;
  for (const test::Configuration& c : test::configurations) {
    for (const int threads : {1, 2}) {
      test::add(c, Mode::paper, 1024, threads);
      test::add(c, Mode::coarse, 1024, threads);
    }
  }
  benchmark::AddCustomContext("vnreg", std::string(version()));
  benchmark::AddCustomContext("instruction set", std::string(instruction_set()));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
