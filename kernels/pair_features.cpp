#include "kernels/pair_features.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vnreg::kernels {
namespace {

constexpr Index chunk = 48;  // pairs at a time: their features stay in L1

Floats padded_column(const RowMajorMatrix& w, Index column) {
  Floats out(static_cast<std::size_t>(padded(w.rows())), 0.0f);
  for (Index r = 0; r < w.rows(); ++r) out[static_cast<std::size_t>(r)] = w(r, column);
  return out;
}

/// [W1; W2 W1] with bias [b1; W2 b1 + b2], composed in float64.
Linear stack_second_layer(const PairTensors& t) {
  using StoredMatrix = Eigen::Map<const RowMajorMatrix>;
  using StoredVector = Eigen::Map<const Eigen::VectorXf>;
  const Index p = t.pair;
  const StoredMatrix w1(t.weight1.data(), p, p);
  const StoredMatrix w2(t.similarity_weight0.data(), p, p);
  const StoredVector b1(t.bias1.data(), p);
  const StoredVector b2(t.similarity_bias0.data(), p);
  RowMajorMatrix weights = RowMajorMatrix::Zero(2 * padded(p), padded(p));
  weights.topLeftCorner(p, p) = w1;
  weights.block(padded(p), 0, p, p) = (w2.cast<double>() * w1.cast<double>()).cast<float>();
  Eigen::VectorXf bias = Eigen::VectorXf::Zero(2 * padded(p));
  bias.head(p) = b1;
  bias.segment(padded(p), p) =
      (w2.cast<double>() * b1.cast<double>() + b2.cast<double>()).cast<float>();
  return {weights, {bias.data(), static_cast<std::size_t>(bias.size())}};
}

/// e, 1 / (e + 1e-8) and x - y of one source point against `n` targets from `first`.
void measure_pairs(const float position[3], const Coordinates& targets, Index first, Index n,
                   PairScratch& s) noexcept {
  const float px = position[0];
  const float py = position[1];
  const float pz = position[2];
  const float* tx = targets.x + first;
  const float* ty = targets.y + first;
  const float* tz = targets.z + first;
  float* e = s.distance.data();
  float* dx = s.dx.data();
  float* dy = s.dy.data();
  float* dz = s.dz.data();
#pragma omp simd
  for (Index j = 0; j < n; ++j) {
    const float x = px - tx[j];
    const float y = py - ty[j];
    const float z = pz - tz[j];
    e[j] = std::sqrt(x * x + y * y + z * z);
    const float inverse = 1.0f / (e[j] + 1e-8f);
    dx[j] = x * inverse;
    dy[j] = y * inverse;
    dz[j] = z * inverse;
  }
}

/// relu(W0 [...] + b0) of the chunk into s.first.
void first_layer(const PairLayer& layer, const float* source_part, const float* target_parts,
                 Index n, PairScratch& s) noexcept {
  const float* we = layer.distance.data();
  const float* wx = layer.direction[0].data();
  const float* wy = layer.direction[1].data();
  const float* wz = layer.direction[2].data();
  for (Index j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const float e = s.distance[at];
    const float dx = s.dx[at];
    const float dy = s.dy[at];
    const float dz = s.dz[at];
    const float* target_part = target_parts + j * layer.rows;
    float* out = s.first.data() + j * layer.rows;
#pragma omp simd
    for (Index p = 0; p < layer.rows; ++p) {
      const float sum =
          source_part[p] + target_part[p] + we[p] * e + wx[p] * dx + wy[p] * dy + wz[p] * dz;
      out[p] = sum > 0.0f ? sum : 0.0f;
    }
  }
}

float similarity(const PairLayer& layer, const float* hidden) noexcept {
  const Eigen::Map<const Eigen::ArrayXf> h(hidden, layer.rows);
  const Eigen::Map<const Eigen::ArrayXf> w(layer.similarity.data(), layer.rows);
  const float value = (h.max(0.0f) * w).sum() + layer.similarity_bias;
  return std::clamp(value, -similarity_limit, similarity_limit);
}

}  // namespace

PairLayer make_pair_layer(const PairTensors& t) {
  const Index d = t.descriptor;
  const RowMajorMatrix w0 = Eigen::Map<const RowMajorMatrix>(t.weight0.data(), t.pair, 2 * d + 4);
  PairLayer layer;
  layer.rows = padded(t.pair);
  layer.source = Linear(w0.leftCols(d), t.bias0);
  layer.target = Linear(w0.middleCols(d, d), {});
  layer.distance = padded_column(w0, 2 * d);
  for (Index axis = 0; axis < 3; ++axis)
    layer.direction[axis] = padded_column(w0, 2 * d + 1 + axis);
  layer.stacked = stack_second_layer(t);
  layer.similarity.assign(static_cast<std::size_t>(layer.rows), 0.0f);
  std::copy(t.similarity_weight1.begin(), t.similarity_weight1.end(), layer.similarity.begin());
  layer.similarity_bias = t.similarity_bias1[0];
  return layer;
}

PairScratch::PairScratch(const PairLayer& layer)
    : first(static_cast<std::size_t>(layer.rows * chunk)),
      second(static_cast<std::size_t>(2 * layer.rows * chunk)),
      distance(chunk),
      dx(chunk),
      dy(chunk),
      dz(chunk) {}

void pair_row(const PairLayer& layer, const float* source_part, const float* target_parts,
              const float position[3], const Coordinates& targets, Index count,
              PairScratch& scratch, float* similarities, float* row_maximum) noexcept {
  Eigen::Map<Eigen::ArrayXf> maximum(row_maximum, layer.rows);
  maximum.setConstant(-std::numeric_limits<float>::infinity());
  for (Index first = 0; first < count; first += chunk) {
    const Index n = std::min(chunk, count - first);
    measure_pairs(position, targets, first, n, scratch);
    first_layer(layer, source_part, target_parts + first * layer.rows, n, scratch);
    linear(layer.stacked, scratch.first.data(), layer.rows, n, scratch.second.data());
    for (Index j = 0; j < n; ++j) {
      const float* column = scratch.second.data() + j * 2 * layer.rows;
      maximum = maximum.max(Eigen::Map<const Eigen::ArrayXf>(column, layer.rows));
      similarities[first + j] = similarity(layer, column + layer.rows);
    }
  }
}

}  // namespace vnreg::kernels
