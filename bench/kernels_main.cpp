// Every kernel, and both encoders, against the roofline of this core.
//
//   kernels_bench                                   all
//   kernels_bench --benchmark_filter='packed.*128'  some
//
// Columns: time; GFLOP/s and GB/s of the counted work; `share` of the roofline (1 = no code could
// be faster); the label names what bounds the benchmark there.
#include <benchmark/benchmark.h>

#include "context.hpp"
#include "roofline.hpp"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  vnreg::bench::add_context();
  vnreg::bench::register_roofline();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
