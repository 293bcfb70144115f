// Layers on vector features, one tile each. Argument: channels.
//
// Flops are those of the products, and of element-wise kernels all that they do; bytes are inputs
// and outputs.
#include "kernels/invariant.hpp"
#include "kernels/mean_pool.hpp"
#include "kernels/operands.hpp"
#include "kernels/vn_block.hpp"
#include "kernels/vn_lean.hpp"
#include "kernels/vn_relu.hpp"
#include "roofline.hpp"

namespace vnreg::bench {
namespace {

using namespace kernels;

double as_double(Index value) { return static_cast<double>(value); }

/// Per channel and point: two dot products, a division, a comparison, and v - f d.
constexpr double relu_flops = 5 + 5 + 3 + 6;

void vn_relu_tile(benchmark::State& state) {
  const Index rows = padded(state.range(0));
  const Floats v = random_floats(rows * 3 * tile, 1);
  Floats d = random_floats(rows * 3 * tile, 2);
  for (auto _ : state) {
    vn_relu(tile, rows, tile_view(v.data(), rows, tile), tile_view(d.data(), rows, tile));
    benchmark::ClobberMemory();
  }
  count(state, {relu_flops * as_double(rows * tile), 36 * as_double(rows * tile)});
}
BENCHMARK(vn_relu_tile)->Arg(32)->Arg(48)->Arg(128)->Arg(256);

/// One direction per point for all channels.
void vn_relu_shared_tile(benchmark::State& state) {
  const Index rows = padded(state.range(0));
  const Floats v = random_floats(rows * 3 * tile, 1);
  const Floats d = random_floats(packet_size * 3 * tile, 2);
  Floats out = room(rows * 3 * tile);
  for (auto _ : state) {
    vn_relu_shared(tile, rows, tile_view<const float>(v.data(), rows, tile),
                   tile_view<const float>(d.data(), packet_size, tile),
                   tile_view(out.data(), rows, tile));
    benchmark::ClobberMemory();
  }
  count(state, {(relu_flops - 5) * as_double(rows * tile), 24 * as_double(rows * tile)});
}
BENCHMARK(vn_relu_shared_tile)->Arg(48)->Arg(96);

struct BlockWeights {
  explicit BlockWeights(Index c, bool shared = false)
      : relu0(random_floats((shared ? 1 : 2 * c) * 2 * c)),
        fc0(random_floats(2 * c * c)),
        relu1(random_floats((shared ? 1 : c) * c)),
        fc1(random_floats(c * c)),
        shortcut(random_floats(2 * c * c)),
        tensors{2 * c, c, shared, relu0, fc0, relu1, fc1, shortcut} {}

  Floats relu0, fc0, relu1, fc1, shortcut;
  VnBlockTensors tensors;
};

/// A block 2C -> C whose second half of the input is constant: 7 products of C x C per component.
void run_block(benchmark::State& state, bool shared) {
  const Index c = state.range(0);
  const BlockWeights weights(c, shared);
  const VnBlock block = make_vn_block(weights.tensors);
  VnBlockConstants constants;
  constants.reserve(block);
  set_constants(block, random_floats(3 * block.half).data(), constants);
  VnScratch scratch;
  scratch.reserve(block.half, block.tail, tile);
  const Floats v = random_floats(block.half * 3 * tile);
  Floats out = room(block.out_rows() * 3 * tile);
  for (auto _ : state) {
    vn_block(block, constants, v.data(), tile, scratch, out.data());
    benchmark::ClobberMemory();
  }
  const double products = shared ? 4 : 7;  // with one direction, U0 and U1 are single rows
  count(state, {2 * products * as_double(c * c * 3 * tile),
                4 * (products * as_double(c * c) + 2 * as_double(c * 3 * tile))});
}
void vn_block_tile(benchmark::State& state) { run_block(state, false); }
void vn_block_shared_tile(benchmark::State& state) { run_block(state, true); }
BENCHMARK(vn_block_tile)->Arg(32)->Arg(48)->Arg(64)->Arg(128);
BENCHMARK(vn_block_shared_tile)->Arg(48);

/// The block behind the linear layer on three edge vectors: 4 products of C x C, others of C x 3.
void edge_block_tile(benchmark::State& state) {
  const Index c = state.range(0);
  const BlockWeights weights(c);
  const EdgeBlock block = make_edge_block(random_floats(2 * c * 3), weights.tensors);
  VnScratch scratch;
  scratch.reserve(block.half, block.tail, tile);
  const Floats edges = random_floats(3 * 3 * tile);
  Floats out = room(block.out_rows() * 3 * tile);
  for (auto _ : state) {
    edge_block(block, edges.data(), tile, scratch, out.data());
    benchmark::ClobberMemory();
  }
  const double weight_count = 4 * as_double(c * c) + 5 * 3 * as_double(c);
  count(state,
        {2 * weight_count * as_double(3 * tile), 4 * (weight_count + as_double(c * 3 * tile))});
}
BENCHMARK(edge_block_tile)->Arg(48)->Arg(128);

/// A block of the network `vnreg`: 2 products of C x C, normalisation and VN-ReLU.
void lean_block_tile(benchmark::State& state) {
  const Index c = state.range(0);
  const LeanBlock block{
      PackedMatrix(random_matrix(c, c, 1)), PackedMatrix(random_matrix(c, c, 2)), {}};
  const Index size = block.rows() * 3 * tile;
  Floats v = random_floats(size), normalized = room(size), h = room(size);
  const Floats start = v;
  for (auto _ : state) {
    v = start;  // v += W h would grow without end
    lean_block(block, tile, v.data(), normalized.data(), h.data());
    benchmark::ClobberMemory();
  }
  count(state, {4 * as_double(c * c * 3 * tile), 4 * as_double(2 * c * c + 2 * size)});
}
BENCHMARK(lean_block_tile)->Arg(32)->Arg(64);

void normalize_vectors_tile(benchmark::State& state) {
  const Index c = state.range(0), rows = padded(c);
  const Floats v = random_floats(rows * 3 * tile);
  Floats n = room(rows * 3 * tile);
  for (auto _ : state) {
    normalize_vectors(v.data(), rows, c, tile, n.data());
    benchmark::ClobberMemory();
  }
  count(state, {9 * as_double(rows * tile), 24 * as_double(rows * tile)});
}
BENCHMARK(normalize_vectors_tile)->Arg(32)->Arg(128);

/// Inner products of every channel with four partners.
void partner_products_tile(benchmark::State& state) {
  constexpr Index partners = 4;
  const Index rows = padded(state.range(0)), partner_rows = padded(partners);
  const Floats v = random_floats(rows * 3 * tile), q = random_floats(partner_rows * 3 * tile);
  Floats out = room(partners * rows * tile);
  for (auto _ : state) {
    partner_products(v.data(), rows, q.data(), partner_rows, false, partners, tile, out.data(),
                     partners * rows);
    benchmark::ClobberMemory();
  }
  count(state, {5 * as_double(partners * rows * tile),
                4 * as_double((3 * rows + 3 * partners + partners * rows) * tile)});
}
BENCHMARK(partner_products_tile)->Arg(32)->Arg(128);

/// VN-linear L -> L / 2, batch norm, VN-ReLU.
void vn_norm_layer_tile(benchmark::State& state) {
  const Index in = state.range(0), out = in / 2;
  const VnNormLayer layer = make_vn_norm_layer(random_matrix(out, in, 1), random_matrix(out, in, 2),
                                               random_floats(out, 3), random_floats(out, 4), false);
  const Floats v = random_floats(padded(in) * 3 * tile);
  Floats projected = room(layer.out_rows() * 3 * tile), result = projected;
  Floats direction = room(packet_size * 3 * tile);
  for (auto _ : state) {
    vn_norm_layer(layer, v.data(), padded(in), tile, projected.data(), direction.data(),
                  result.data());
    benchmark::ClobberMemory();
  }
  count(state,
        {4 * as_double(out * in * 3 * tile), 4 * as_double(2 * out * in + (in + out) * 3 * tile)});
}
BENCHMARK(vn_norm_layer_tile)->Arg(32)->Arg(64);

/// V Z^T of every point.
void invariant_products_tile(benchmark::State& state) {
  const Index rows = padded(state.range(0)), frame_rows = padded(3);
  const Floats v = random_floats(rows * 3 * tile), frame = random_floats(frame_rows * 3 * tile);
  Floats products = room(3 * rows * tile);
  for (auto _ : state) {
    invariant_products(v.data(), rows, frame.data(), frame_rows, tile, products.data());
    benchmark::ClobberMemory();
  }
  count(state, {15 * as_double(rows * tile), 4 * as_double((6 * rows + 9) * tile)});
}
BENCHMARK(invariant_products_tile)->Arg(32)->Arg(64);

void sum_tile_points(benchmark::State& state) {
  const Index rows = padded(state.range(0));
  const Floats v = random_floats(rows * 3 * tile);
  Floats sums = room(3 * rows);
  for (auto _ : state) {
    sum_tile(v.data(), rows, tile, sums.data());
    benchmark::ClobberMemory();
  }
  count(state, {as_double(rows * 3 * tile), 4 * as_double(rows * 3 * (tile + 1))});
}
BENCHMARK(sum_tile_points)->Arg(32)->Arg(128);

/// The sums of the 32 tiles of 1,024 points, in float64.
void mean_of_tile_sums(benchmark::State& state) {
  constexpr Index tiles = 32;
  const Index rows = padded(state.range(0));
  const Floats sums = random_floats(rows * 3 * tiles);
  Floats mean = room(3 * rows);
  for (auto _ : state) {
    mean_of_tiles(sums.data(), rows, tiles, tile * tiles, mean.data());
    benchmark::ClobberMemory();
  }
  count(state, {as_double(rows * 3 * tiles), 4 * as_double(rows * 3 * (tiles + 1))});
}
BENCHMARK(mean_of_tile_sums)->Arg(32)->Arg(128);

}  // namespace
}  // namespace vnreg::bench
