#include "roofline.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <string>
#include <vector>

namespace vnreg::bench {
namespace {

constexpr const char* level_names[4] = {"L1", "L2", "L3", "memory"};
/// Largest working sets that are counted to a level: a bit less than common cache sizes.
constexpr double level_bytes[3] = {28e3, 800e3, 16e6};
/// What the triads run over.
constexpr double triad_bytes[4] = {24e3, 400e3, 8e6, 200e6};

/// Processor time, as Google Benchmark counts it: other programs on the core are left out.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The shortest of the runs that fit in a third of a second, at least five.
template <class Run>
double best_seconds(const Run& run) {
  double best = 1e9, total = 0;
  for (int i = 0; i < 5 || total < 0.3; ++i) {
    const double start = cpu_seconds();
    run();
    const double taken = cpu_seconds() - start;
    best = std::min(best, taken);
    total += taken;
  }
  return best;
}

double measure_product() {
  constexpr Eigen::Index size = 768;
  const Eigen::MatrixXf a = Eigen::MatrixXf::Random(size, size);
  const Eigen::MatrixXf b = Eigen::MatrixXf::Random(size, size);
  Eigen::MatrixXf c(size, size);
  const double seconds = best_seconds([&] {
    c.noalias() = a * b;
    benchmark::ClobberMemory();
  });
  return 1e-9 * 2 * static_cast<double>(size * size * size) / seconds;
}

double measure_triad(double bytes) {
  const auto size = static_cast<Eigen::Index>(bytes / (3 * sizeof(float)));
  Eigen::ArrayXf a = Eigen::ArrayXf::Zero(size);
  const Eigen::ArrayXf b = Eigen::ArrayXf::Random(size), c = Eigen::ArrayXf::Random(size);
  // Short sets are repeated until a run takes about a millisecond.
  const int repeats = std::max(1, static_cast<int>(50e6 / bytes));
  const double seconds = best_seconds([&] {
    for (int i = 0; i < repeats; ++i) {
      a = b + 0.5f * c;
      benchmark::ClobberMemory();
    }
  });
  return 1e-9 * 3 * sizeof(float) * static_cast<double>(size) * repeats / seconds;
}

Level level_of(double bytes) {
  const auto* above = std::find_if(std::begin(level_bytes), std::end(level_bytes),
                                   [&](double limit) { return bytes <= limit; });
  return static_cast<Level>(above - std::begin(level_bytes));
}

benchmark::Counter rate(double per_iteration) {
  return {per_iteration, benchmark::Counter::kIsIterationInvariantRate};
}

}  // namespace

const Roofline& roofline() {
  static const Roofline measured = [] {
    Roofline r{};
    r.gflops = measure_product();
    for (int i = 0; i < 4; ++i) r.gigabytes_per_s[i] = measure_triad(triad_bytes[i]);
    return r;
  }();
  return measured;
}

void count(benchmark::State& state, const Work& work) {
  const Roofline& roof = roofline();
  const Level level = level_of(work.bytes);
  const double compute_s = 1e-9 * work.flops / roof.gflops;
  const double transfer_s = 1e-9 * work.bytes / roof.bandwidth(level);
  state.counters["GFLOP/s"] = rate(1e-9 * work.flops);
  state.counters["GB/s"] = rate(1e-9 * work.bytes);
  state.counters["share"] = rate(std::max(compute_s, transfer_s));
  state.SetLabel(compute_s >= transfer_s ? "product" : level_names[static_cast<int>(level)]);
}

void add_roofline_context() {
  const Roofline& roof = roofline();
  benchmark::AddCustomContext("roof product GFLOP/s", std::to_string(roof.gflops));
  for (int i = 0; i < 4; ++i) {
    benchmark::AddCustomContext(std::string("roof triad ") + level_names[i] + " GB/s",
                                std::to_string(roof.gigabytes_per_s[i]));
  }
}

}  // namespace vnreg::bench
