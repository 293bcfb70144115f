// Kernels of the registers: pair features, selection, poses.
#include <algorithm>
#include <cmath>

#include "kernels/fit_rotations.hpp"
#include "kernels/least_direction.hpp"
#include "kernels/operands.hpp"
#include "kernels/pair_features.hpp"
#include "kernels/procrustes.hpp"
#include "kernels/top_k.hpp"
#include "roofline.hpp"

namespace vnreg::bench {
namespace {

using namespace kernels;

double as_double(Index value) { return static_cast<double>(value); }

/// One of 170 source points against 170 target points, D = 64. Argument: pair channels P. Counted:
/// the stacked product, the distance part of the first layer and the last inner product.
void pair_features_row(benchmark::State& state) {
  const Index p = state.range(0);
  const Index d = 64;
  const Index points_count = 170;
  const Floats w0 = random_floats(p * (2 * d + 4)), w = random_floats(p * p), b = random_floats(p);
  const PairLayer layer =
      make_pair_layer({d, p, w0, b, w, b, w, b, std::span(b), std::span(b).first(1)});
  const Floats source = random_floats(layer.rows);
  const Floats targets = random_floats(layer.rows * points_count);
  const Sphere points(points_count);
  const float position[3] = {0.1f, 0.2f, 0.3f};
  PairScratch scratch(layer);
  Floats similarities = room(points_count), maximum = room(layer.rows);
  for (auto _ : state) {
    pair_row(layer, source.data(), targets.data(), position, points.coordinates(), points_count,
             scratch, similarities.data(), maximum.data());
    benchmark::ClobberMemory();
  }
  count(state, {as_double(points_count * (4 * p * p + 12 * p)),
                4 * as_double(2 * p * p + points_count * (p + 4))});
}
BENCHMARK(pair_features_row)->Arg(16)->Arg(32)->Arg(64)->Unit(benchmark::kMicrosecond);

/// In float64. Counted: means and covariance, 24 flops per pair of points.
void procrustes_pairs(benchmark::State& state) {
  const Index points_count = state.range(0);
  const Sphere x(points_count);
  const Floats weights(static_cast<std::size_t>(points_count), 0.5f);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        procrustes(x.coordinates(), x.coordinates(), weights.data(), points_count));
  }
  count(state, {24 * as_double(points_count), 28 * as_double(points_count)});
}
BENCHMARK(procrustes_pairs)->Arg(12)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);

/// One rotation after the other; what the batches below are compared with.
void fit_rotation_single(benchmark::State& state) {
  std::vector<Eigen::Matrix3d> h(static_cast<std::size_t>(state.range(0)));
  for (std::size_t i = 0; i < h.size(); ++i) h[i] = random_matrix(3, 3, i + 1).cast<double>();
  for (auto _ : state) {
    for (const Eigen::Matrix3d& matrix : h) benchmark::DoNotOptimize(fit_rotation(matrix));
  }
  count(state, {0, as_double(state.range(0)) * (72 + sizeof(RotationFit))});
}
BENCHMARK(fit_rotation_single)->Arg(64)->Unit(benchmark::kMicrosecond);

/// A batch of matrices 3 x 3 to rotations, float64.
void fit_rotation_batch(benchmark::State& state) {
  const Floats values = random_floats(9 * MatrixBatch::capacity);
  MatrixBatch h, rotation;
  for (Index e = 0; e < 9; ++e) {
    std::copy_n(values.data() + e * MatrixBatch::capacity, MatrixBatch::capacity, h.entry[e]);
  }
  bool determined[MatrixBatch::capacity];
  for (auto _ : state) {
    fit_rotations(h, state.range(0), rotation, determined);
    benchmark::ClobberMemory();
  }
  count(state, {0, as_double(state.range(0)) * (72 + 72 + 1)});
}
BENCHMARK(fit_rotation_batch)->Arg(64)->Unit(benchmark::kMicrosecond);

/// Normals of tangent planes from covariances.
void least_direction_batch(benchmark::State& state) {
  const Index matrices = state.range(0);
  Floats entries[6], out[3];
  for (std::size_t e = 0; e < 6; ++e) entries[e] = random_floats(matrices, e + 1);
  for (const std::size_t diagonal : {0, 3, 5}) {
    for (float& v : entries[diagonal]) v = 1 + std::abs(v);
  }
  for (Floats& o : out) o = room(matrices);
  for (auto _ : state) {
    least_directions({entries[0].data(), entries[1].data(), entries[2].data(), entries[3].data(),
                      entries[4].data(), entries[5].data()},
                     matrices, out[0].data(), out[1].data(), out[2].data());
    benchmark::ClobberMemory();
  }
  count(state, {0, 36 * as_double(matrices)});
}
BENCHMARK(least_direction_batch)->Arg(64)->Arg(1024)->Unit(benchmark::kMicrosecond);

void top_sixth(benchmark::State& state) {
  const Floats values = random_floats(state.range(0));
  std::vector<std::uint64_t> scratch(values.size());
  std::vector<std::uint32_t> out(values.size() / 6);
  for (auto _ : state) {
    top_k(values, scratch, out);
    benchmark::ClobberMemory();
  }
  count(state, {0, 4 * as_double(state.range(0)) + 4 * static_cast<double>(out.size())});
}
BENCHMARK(top_sixth)->Arg(128)->Arg(1024)->Arg(16384)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vnreg::bench
