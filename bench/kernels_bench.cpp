// The kernels one by one, on the sizes of the network. Products are given in GFLOP/s, beside
// Eigen's product on the same operands.
#include <benchmark/benchmark.h>

#include <random>

#include "kernels/neighbours.hpp"
#include "kernels/pair_features.hpp"
#include "kernels/procrustes.hpp"
#include "kernels/top_k.hpp"
#include "kernels/vn_block.hpp"
#include "kernels/vn_relu.hpp"

namespace vnreg::kernels {
namespace {

constexpr Index tile = 32;

Floats random_floats(Index count, std::uint64_t seed = 1) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  Floats values(static_cast<std::size_t>(count));
  for (float& v : values) v = 0.1f * normal(engine);
  return values;
}

RowMajorMatrix random_matrix(Index rows, Index cols) {
  const Floats values = random_floats(rows * cols);
  return Eigen::Map<const RowMajorMatrix>(values.data(), rows, cols);
}

void count_flops(benchmark::State& state, Index per_iteration) {
  state.counters["GFLOP/s"] = benchmark::Counter(1e-9 * static_cast<double>(per_iteration),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}

/// Rows, depth: a VN-linear of one tile.
void packed_product(benchmark::State& state) {
  const Index rows = state.range(0);
  const Index depth = state.range(1);
  const PackedMatrix w(random_matrix(rows, depth));
  const Floats x = random_floats(depth * 3 * tile);
  Floats y(static_cast<std::size_t>(w.padded_rows() * 3 * tile));
  for (auto _ : state) {
    multiply(w, x.data(), depth, 3 * tile, y.data(), w.padded_rows());
    benchmark::ClobberMemory();
  }
  count_flops(state, 2 * rows * depth * 3 * tile);
}

void eigen_product(benchmark::State& state) {
  const Index rows = state.range(0);
  const Index depth = state.range(1);
  const Eigen::MatrixXf w = random_matrix(rows, depth);
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(depth, 3 * tile);
  Eigen::MatrixXf y(rows, 3 * tile);
  for (auto _ : state) {
    y.noalias() = w * x;
    benchmark::ClobberMemory();
  }
  count_flops(state, 2 * rows * depth * 3 * tile);
}

void product_sizes(benchmark::internal::Benchmark* b) {
  for (const auto& [rows, depth] : {std::pair{256, 128},
                                    {128, 256},
                                    {128, 128},
                                    {96, 48},
                                    {48, 96},
                                    {48, 48},
                                    {64, 32},
                                    {32, 64},
                                    {32, 32}}) {
    b->Args({rows, depth});
  }
}
BENCHMARK(packed_product)->Apply(product_sizes);
BENCHMARK(eigen_product)->Apply(product_sizes);

void vn_relu_tile(benchmark::State& state) {
  const Index rows = padded(state.range(0));
  const Floats v = random_floats(rows * 3 * tile, 1);
  Floats d = random_floats(rows * 3 * tile, 2);
  for (auto _ : state) {
    vn_relu(tile, rows, tile_view(v.data(), rows, tile), tile_view(d.data(), rows, tile));
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * rows * tile);
}
BENCHMARK(vn_relu_tile)->Arg(32)->Arg(48)->Arg(128)->Arg(256);

/// A block 2C -> C on one tile.
void vn_block_tile(benchmark::State& state) {
  const Index c = state.range(0);
  const Floats relu0 = random_floats(4 * c * c), fc0 = random_floats(2 * c * c);
  const Floats relu1 = random_floats(c * c), fc1 = random_floats(c * c);
  const Floats shortcut = random_floats(2 * c * c);
  const VnBlock block = make_vn_block({2 * c, c, false, relu0, fc0, relu1, fc1, shortcut});
  VnBlockConstants constants;
  constants.reserve(block);
  set_constants(block, random_floats(3 * block.half).data(), constants);
  VnScratch scratch;
  scratch.reserve(block.half, block.tail, tile);
  const Floats v = random_floats(block.half * 3 * tile);
  Floats out(static_cast<std::size_t>(block.out_rows() * 3 * tile));
  for (auto _ : state) {
    vn_block(block, constants, v.data(), tile, scratch, out.data());
    benchmark::ClobberMemory();
  }
  count_flops(state, 2 * 7 * c * c * 3 * tile);
}
BENCHMARK(vn_block_tile)->Arg(32)->Arg(48)->Arg(128);

struct Sphere {
  Floats x, y, z;

  explicit Sphere(Index count)
      : x(random_floats(count, 1)), y(random_floats(count, 2)), z(random_floats(count, 3)) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const float norm = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
      x[i] /= norm;
      y[i] /= norm;
      z[i] /= norm;
    }
  }
  Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
};

void spatial_index_build(benchmark::State& state) {
  const Sphere points(state.range(0));
  SpatialIndex index(state.range(0));
  for (auto _ : state) {
    index.build(points.coordinates(), state.range(0));
    benchmark::ClobberMemory();
  }
}
BENCHMARK(spatial_index_build)->Arg(1024)->Arg(16384)->Unit(benchmark::kMicrosecond);

/// k = 20, index included.
void mean_neighbours(benchmark::State& state) {
  const Index count = state.range(0);
  const Sphere points(count);
  SpatialIndex index(count);
  NeighbourScratch scratch(count);
  Floats out[4];
  for (Floats& o : out) o.resize(static_cast<std::size_t>(count));
  for (auto _ : state) {
    index.build(points.coordinates(), count);
    mean_neighbour_offsets(index, 20, 0, index.leaves(), scratch, out[0].data(), out[1].data(),
                           out[2].data(), out[3].data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(mean_neighbours)->Arg(1024)->Arg(4096)->Arg(16384)->Unit(benchmark::kMicrosecond);

void nearest(benchmark::State& state) {
  const Index count = state.range(0);
  const Sphere points(count);
  SpatialIndex index(count);
  index.build(points.coordinates(), count);
  NeighbourScratch scratch(count);
  Floats squared(static_cast<std::size_t>(count));
  Floats moved[3];
  for (Index axis = 0; axis < 3; ++axis) {
    const Coordinates o = index.ordered();
    const float* from[3] = {o.x, o.y, o.z};
    moved[axis].assign(from[axis], from[axis] + count);
    for (float& v : moved[axis]) v += 0.01f;
  }
  for (auto _ : state) {
    nearest_distances(index, {moved[0].data(), moved[1].data(), moved[2].data()}, count, scratch,
                      squared.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(nearest)->Arg(1024)->Arg(16384)->Unit(benchmark::kMicrosecond);

/// One of 170 source points against 170 target points, D = 64.
void pair_features_row(benchmark::State& state) {
  const Index p = state.range(0);
  const Index d = 64;
  const Index count = 170;
  const Floats w0 = random_floats(p * (2 * d + 4)), w = random_floats(p * p), b = random_floats(p);
  const PairLayer layer =
      make_pair_layer({d, p, w0, b, w, b, w, b, std::span(b), std::span(b).first(1)});
  const Floats source = random_floats(layer.rows);
  const Floats targets = random_floats(layer.rows * count);
  const Sphere points(count);
  const float position[3] = {0.1f, 0.2f, 0.3f};
  PairScratch scratch(layer);
  Floats similarities(static_cast<std::size_t>(count)), maximum(static_cast<std::size_t>(p));
  maximum.resize(static_cast<std::size_t>(layer.rows));
  for (auto _ : state) {
    pair_row(layer, source.data(), targets.data(), position, points.coordinates(), count, scratch,
             similarities.data(), maximum.data());
    benchmark::ClobberMemory();
  }
  count_flops(state, count * (4 * p * p + 12 * p));
}
BENCHMARK(pair_features_row)->Arg(16)->Arg(32)->Unit(benchmark::kMicrosecond);

void procrustes_pairs(benchmark::State& state) {
  const Sphere x(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(procrustes(x.coordinates(), x.coordinates(), nullptr, state.range(0)));
  }
}
BENCHMARK(procrustes_pairs)->Arg(128)->Unit(benchmark::kMicrosecond);

void top_sixth(benchmark::State& state) {
  const Floats values = random_floats(state.range(0));
  std::vector<std::uint64_t> scratch(values.size());
  std::vector<std::uint32_t> out(values.size() / 6);
  for (auto _ : state) {
    top_k(values, scratch, out);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(top_sixth)->Arg(1024)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vnreg::kernels

BENCHMARK_MAIN();
