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
/// What the triads run over: arrays that do not lie a multiple of a page apart, whose loads and
/// stores would be taken for the same place.
constexpr double triad_bytes[4] = {20e3, 400e3, 8e6, 200e6};

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

class Product {
 public:
  void run() {
    c_.noalias() = a_ * b_;
    benchmark::ClobberMemory();
  }
  static double flops() { return 2 * static_cast<double>(size * size * size); }

 private:
  static constexpr Eigen::Index size = 768;
  Eigen::MatrixXf a_ = Eigen::MatrixXf::Random(size, size);
  Eigen::MatrixXf b_ = Eigen::MatrixXf::Random(size, size);
  Eigen::MatrixXf c_ = Eigen::MatrixXf::Zero(size, size);
};

/// a = b + s c over `bytes`; short sets repeatedly, until a run takes about a millisecond.
class Triad {
 public:
  explicit Triad(double bytes)
      : repeats_(std::max(1, static_cast<int>(50e6 / bytes))),
        a_(Eigen::ArrayXf::Zero(static_cast<Eigen::Index>(bytes / (3 * sizeof(float))))),
        b_(Eigen::ArrayXf::Random(a_.size())),
        c_(Eigen::ArrayXf::Random(a_.size())) {}
  void run() {
    for (int i = 0; i < repeats_; ++i) {
      a_ = b_ + 0.5f * c_;
      benchmark::ClobberMemory();
    }
  }
  double bytes() const { return 3 * sizeof(float) * static_cast<double>(a_.size()) * repeats_; }

 private:
  int repeats_;
  Eigen::ArrayXf a_, b_, c_;
};

Level level_of(double bytes) {
  const auto* above = std::find_if(std::begin(level_bytes), std::end(level_bytes),
                                   [&](double limit) { return bytes <= limit; });
  return static_cast<Level>(above - std::begin(level_bytes));
}

benchmark::Counter rate(double per_iteration) {
  return {per_iteration, benchmark::Counter::kIsIterationInvariantRate};
}

void product_again(benchmark::State& state) {
  Product product;
  for (auto _ : state) product.run();
  state.counters["GFLOP/s"] = rate(1e-9 * Product::flops());
  state.counters["GB/s"] = rate(0);
  state.counters["share"] = rate(1e-9 * Product::flops() / roofline().gflops);
  state.SetLabel("product");
}

void triad_again(benchmark::State& state, int level) {
  Triad triad(triad_bytes[level]);
  for (auto _ : state) triad.run();
  state.counters["GFLOP/s"] = rate(0);
  state.counters["GB/s"] = rate(1e-9 * triad.bytes());
  state.counters["share"] = rate(1e-9 * triad.bytes() / roofline().gigabytes_per_s[level]);
  state.SetLabel(level_names[level]);
}

}  // namespace

const Roofline& roofline() {
  static const Roofline measured = [] {
    Roofline r{};
    Product product;
    r.gflops = 1e-9 * Product::flops() / best_seconds([&] { product.run(); });
    for (int i = 0; i < 4; ++i) {
      Triad triad(triad_bytes[i]);
      r.gigabytes_per_s[i] = 1e-9 * triad.bytes() / best_seconds([&] { triad.run(); });
    }
    return r;
  }();
  return measured;
}

void count(benchmark::State& state, const Work& work, int threads) {
  const Roofline& roof = roofline();
  const Level level = level_of(work.bytes);
  const double compute_s = 1e-9 * work.flops / roof.gflops;
  const double transfer_s = 1e-9 * work.bytes / roof.bandwidth(level);
  state.counters["GFLOP/s"] = rate(1e-9 * work.flops);
  state.counters["GB/s"] = rate(1e-9 * work.bytes);
  state.counters["share"] = rate(std::max(compute_s, transfer_s) / threads);
  state.SetLabel(compute_s >= transfer_s ? "product" : level_names[static_cast<int>(level)]);
}

void register_roofline() {
  const Roofline& roof = roofline();
  benchmark::AddCustomContext("roof product GFLOP/s", std::to_string(roof.gflops));
  for (int i = 0; i < 4; ++i) {
    benchmark::AddCustomContext(std::string("roof triad ") + level_names[i] + " GB/s",
                                std::to_string(roof.gigabytes_per_s[i]));
  }
  benchmark::RegisterBenchmark("roof/product", product_again);
  for (int i = 0; i < 4; ++i) {
    const std::string name = std::string("roof/") + level_names[i];
    benchmark::RegisterBenchmark(name.c_str(), triad_again, i);
  }
}

}  // namespace vnreg::bench
