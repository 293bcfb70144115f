// Every kernel, and both encoders, against the roofline of this core.
//
//   kernels_bench                                   all
//   kernels_bench --benchmark_filter='packed.*128'  some
//
// Columns: time; GFLOP/s and GB/s of the counted work; `share` of the roofline (1 = no code could
// be faster); the label names what bounds the benchmark there.
#include <benchmark/benchmark.h>

#include "roofline.hpp"
#include "vnreg/vnreg.hpp"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::AddCustomContext("vnreg", std::string(vnreg::version()));
  benchmark::AddCustomContext("compiler", VNREG_COMPILER ", " VNREG_BUILD_TYPE);
  benchmark::AddCustomContext("instruction set", std::string(vnreg::instruction_set()));
  vnreg::bench::register_roofline();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
