// Milliseconds per pair of the whole registration and of its stages (Result::ms), for comparing
// one commit with another. Random weights but for `vnreg`, the built-in model: there the work
// depends on what the network says.
//
//   align_bench                                       NETWORK/MODE/points/threads, all
//   align_bench --benchmark_filter='vnreg.*threads:1'
#include <benchmark/benchmark.h>

#include <string>

#include "clouds.hpp"
#include "context.hpp"
#include "random_model.hpp"

namespace vnreg::bench {
namespace {

using test::Points;
using test::Widths;

Model random_paper_model(std::uint64_t global, std::uint64_t local) {
  return test::random_model({.global = global,
                             .local = local,
                             .descriptor = 64,
                             .pair = 32,
                             .significance = {64, 32},
                             .neighbours = 20})
      .build();
}

void align_pair(benchmark::State& state, const Model& model, Mode mode, std::size_t points,
                int threads) {
  test::Random random(1);
  const Points source = test::shape(points, random);
  const Points target = test::moved(test::shape(points, random), test::random_motion(random, 1));
  Registrar registrar(model,
                      {.mode = mode, .threads = threads, .max_points = static_cast<int>(points)});
  StageTimes ms = registrar.align(source, target).ms;
  for (auto _ : state) ms = registrar.align(source, target).ms;
  state.counters["prepare"] = ms.prepare;
  state.counters["encode"] = ms.encode;
  state.counters["fine"] = ms.fine;
  state.counters["hypotheses"] = ms.hypotheses;
  state.counters["verify"] = ms.verify;
  state.counters["measure"] = ms.measure;
}

void add(const std::string& network, const Model& model, Mode mode, std::size_t points) {
  for (const int threads : {1, 2}) {
    const std::string name = network + "/" + std::string(to_string(mode)) +
                             "/points:" + std::to_string(points) +
                             "/threads:" + std::to_string(threads);
    benchmark::RegisterBenchmark(
        name.c_str(),
        [=](benchmark::State& state) { align_pair(state, model, mode, points, threads); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

}  // namespace
}  // namespace vnreg::bench

int main(int argc, char** argv) {
  using namespace vnreg;
  for (const std::size_t points : {512, 1024}) {
    bench::add("vnreg", Model::builtin(), Mode::verified, points);
  }
  bench::add("paper", bench::random_paper_model(128, 64), Mode::paper, 1024);
  bench::add("width48", bench::random_paper_model(48, 32), Mode::paper, 1024);
  bench::add_context();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
