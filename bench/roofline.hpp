// What this core can do at most, measured when the program starts, and work counted against it.
#pragma once

#include <benchmark/benchmark.h>

namespace vnreg::bench {

/// The smallest cache that holds a working set.
enum class Level { l1, l2, l3, memory };

struct Roofline {
  double gflops;              // of a large product by Eigen: one thread, the build's instructions
  double gigabytes_per_s[4];  // of a triad a = b + s c (STREAM), by Level
  double bandwidth(Level level) const { return gigabytes_per_s[static_cast<int>(level)]; }
};

/// Measured at the first call (about a second): the best of many short runs.
const Roofline& roofline();

/// What one iteration of a benchmark does. Bytes: every operand once, as if nothing were cached.
struct Work {
  double flops;
  double bytes;
};

/// Adds counters to the benchmark: GFLOP/s, GB/s, and `share`, the least time that the roofline
/// allows (the larger of flops over peak and bytes over the bandwidth of the level that holds them)
/// over the time taken, of as many cores as there are threads. The label names what bounds it.
void count(benchmark::State& state, const Work& work, int threads = 1);

/// Tells the roofline in the report's context, and registers it as benchmarks: run among the
/// others, they tell whether the processor still does what it did at the start.
void register_roofline();

}  // namespace vnreg::bench
