// Products of packed weights with the features of a tile or of points, beside Eigen's product on
// the same operands. Arguments: rows, depth.
#include "kernels/linear.hpp"
#include "kernels/operands.hpp"
#include "kernels/vn_linear.hpp"
#include "roofline.hpp"

namespace vnreg::bench {
namespace {

using namespace kernels;

constexpr Index columns = 3 * tile;

Work product_work(Index rows, Index depth, Index width) {
  return {2.0 * static_cast<double>(rows * depth * width),
          4.0 * static_cast<double>(rows * depth + (rows + depth) * width)};
}

struct ProductOperands {
  explicit ProductOperands(const benchmark::State& state)
      : rows(state.range(0)),
        depth(state.range(1)),
        weights(random_matrix(rows, depth)),
        w(weights),
        x(random_floats(depth * columns)),
        y(room(w.padded_rows() * columns)) {}

  Index rows, depth;
  RowMajorMatrix weights;
  PackedMatrix w;
  Floats x, y;
};

void packed_product(benchmark::State& state) {
  ProductOperands o(state);
  for (auto _ : state) {
    multiply(o.w, o.x.data(), o.depth, columns, o.y.data(), o.w.padded_rows());
    benchmark::ClobberMemory();
  }
  count(state, product_work(o.rows, o.depth, columns));
}

void packed_product_add(benchmark::State& state) {
  ProductOperands o(state);
  for (auto _ : state) {
    multiply_add(o.w, o.x.data(), o.depth, columns, o.y.data(), o.w.padded_rows());
    benchmark::ClobberMemory();
  }
  count(state, product_work(o.rows, o.depth, columns));
}

void packed_product_bias(benchmark::State& state) {
  ProductOperands o(state);
  const Floats bias = random_floats(3 * o.w.padded_rows(), 5);
  for (auto _ : state) {
    multiply_bias(o.w, o.x.data(), o.depth, columns, o.y.data(), o.w.padded_rows(), bias.data(),
                  o.w.padded_rows(), tile);
    benchmark::ClobberMemory();
  }
  count(state, product_work(o.rows, o.depth, columns));
}

void eigen_product(benchmark::State& state) {
  const ProductOperands o(state);
  const Eigen::MatrixXf w = o.weights;
  const Eigen::Map<const Eigen::MatrixXf> x(o.x.data(), o.depth, columns);
  Eigen::MatrixXf y(o.rows, columns);
  for (auto _ : state) {
    y.noalias() = w * x;
    benchmark::ClobberMemory();
  }
  count(state, product_work(o.rows, o.depth, columns));
}

/// The widths of the paper's network (C = 128), of `small` (48) and of `vnreg` (32).
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
BENCHMARK(packed_product_add)->Args({128, 128})->Args({32, 32});
BENCHMARK(packed_product_bias)->Args({128, 128})->Args({32, 32});

/// A layer on plain features with bias and ReLU, a tile of points: the MLPs of both networks.
void linear_relu(benchmark::State& state) {
  const Index out = state.range(0), in = state.range(1);
  const Linear layer(random_matrix(out, in), random_floats(out));
  const Floats x = random_floats(padded(in) * tile);
  Floats y = room(layer.padded_rows() * tile);
  for (auto _ : state) {
    linear(layer, x.data(), padded(in), tile, y.data());
    relu(y.data(), layer.padded_rows() * tile);
    benchmark::ClobberMemory();
  }
  count(state, product_work(out, in, tile));
}
BENCHMARK(linear_relu)
    ->Args({48, 18})
    ->Args({48, 48})
    ->Args({48, 176})
    ->Args({48, 224})
    ->Args({48, 400})
    ->Args({64, 192})
    ->Args({64, 64});

}  // namespace
}  // namespace vnreg::bench
