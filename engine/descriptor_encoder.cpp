#include "engine/descriptor_encoder.hpp"

#include <algorithm>
#include <cmath>

#include "engine/counter_hash.hpp"
#include "engine/workspace.hpp"
#include "kernels/mean_pool.hpp"
#include "kernels/vn_relu.hpp"

namespace vnreg::detail {
namespace {

using kernels::LeanBlock;
using kernels::padded;

/// One tile of one cloud, and everything that its stages read and write.
struct Tile {
  const DescriptorModel& model;
  const Cloud& cloud;
  DescriptorFeatures& f;
  DescriptorScratch& s;
  Index first;  // encoded point
  Index width;

  Index vector_rows() const noexcept { return padded(model.arch.vectors); }
  Index scalar_rows() const noexcept { return padded(model.arch.scalars); }
  Index number() const noexcept { return first / encoded_tile; }
  /// Where this tile starts in a buffer of vector features.
  float* vectors(kernels::Floats& buffer, Index rows) const noexcept {
    return buffer.data() + 3 * rows * first;
  }
  float* v() const noexcept { return vectors(f.v, vector_rows()); }
  float* z() const noexcept { return f.z.data() + scalar_rows() * first; }
};

/// Runs over all tiles of the clouds.
class Pass {
 public:
  Pass(const DescriptorModel& model, const Cloud clouds[2], Sides sides, const Threads& threads,
       DescriptorWorkspace& w)
      : model_(model), clouds_(clouds), sides_(sides), threads_(threads), w_(w) {}

  template <class Task>
  void operator()(const Task& task) const noexcept {
    const auto tiles = [&](Index side) { return encoded_tiles(w_.features[side].out.count); };
    parallel_for_parts(threads_, sides_, tiles, [&](Index side, Index tile, int thread) {
      const Index first = tile * encoded_tile;
      DescriptorFeatures& f = w_.features[side];
      task(Tile{model_, clouds_[side], f, w_.scratch[static_cast<std::size_t>(thread)], first,
                std::min(encoded_tile, f.out.count - first)});
    });
  }

 private:
  const DescriptorModel& model_;
  const Cloud* clouds_;
  Sides sides_;
  Threads threads_;
  DescriptorWorkspace& w_;
};

/// Orders the points at random; the index tells equal hashes apart.
std::uint64_t selection_key(std::uint64_t seed, std::uint64_t point) noexcept {
  return (counter_hash(seed, point) & ~std::uint64_t{0xffff}) | point;
}

/// The points with the smallest keys, in the spatial order of the index.
void select_encoded(const Cloud& cloud, Index most, std::uint64_t seed,
                    DescriptorFeatures& f) noexcept {
  const Index wanted = std::min(cloud.count, most);
  for (Index i = 0; i < cloud.count; ++i) {
    f.keys[static_cast<std::size_t>(i)] = selection_key(seed, static_cast<std::uint64_t>(i));
  }
  const auto last = f.keys.begin() + (wanted - 1);
  std::nth_element(f.keys.begin(), last, f.keys.begin() + cloud.count);
  CloudDescriptors& out = f.out;
  out.count = 0;
  for (Index i = 0; i < cloud.count; ++i) {
    const std::uint32_t point = cloud.index.original()[i];
    if (selection_key(seed, point) > *last) continue;
    out.encoded[static_cast<std::size_t>(out.count)] = point;
    out.x[out.count] = cloud.x[point];
    out.y[out.count] = cloud.y[point];
    out.z[out.count] = cloud.z[point];
    ++out.count;
  }
}

/// Column `point` of a tile of `rows` rows takes `count` vectors.
void write_vectors(const kernels::Vector3f* vectors, Index count, Index rows, Index point,
                   Index width, float* tile) noexcept {
  for (Index axis = 0; axis < 3; ++axis) {
    float* column = tile + (axis * width + point) * rows;
    for (Index i = 0; i < count; ++i) column[i] = vectors[i][axis];
  }
}

void write_inputs(const Tile& t) noexcept {
  constexpr Index local_rows = padded(kernels::local_vectors);
  constexpr Index context_rows = padded(kernels::context_vectors);
  constexpr Index scalar_rows = padded(kernels::moment_scalars);
  float* context = t.vectors(t.f.context_inputs, context_rows);
  CloudDescriptors& out = t.f.out;
  for (Index p = 0; p < t.width; ++p) {
    const Index point = t.first + p;
    const float centre[3] = {out.x[point], out.y[point], out.z[point]};
    kernels::Moments moments[kernels::moment_radii];
    kernels::MomentFeatures features;
    kernels::radius_moments(t.cloud.index, centre, t.model.arch.moment_radii,
                            t.s.leaf_bounds.data(), moments);
    kernels::moment_features(moments, centre, features);
    std::copy_n(moments[0].covariance, 6, out.covariance.data() + 6 * point);
    std::copy_n(features.scalars, kernels::moment_scalars,
                t.s.scalar_inputs.data() + scalar_rows * p);
    write_vectors(features.local, kernels::local_vectors, local_rows, p, t.width,
                  t.s.local_inputs.data());
    write_vectors(features.context, kernels::context_vectors, context_rows, p, t.width, context);
  }
  if (!t.f.local_inputs.empty()) {
    std::copy_n(t.s.local_inputs.data(), 3 * local_rows * t.width,
                t.vectors(t.f.local_inputs, local_rows));
    std::copy_n(t.s.scalar_inputs.data(), scalar_rows * t.width,
                t.f.scalar_inputs.data() + scalar_rows * t.first);
  }
}

/// y = ReLU(W x + b) of every point of the tile.
void relu_layer(const kernels::Linear& layer, const float* x, Index x_stride, Index width,
                float* y) noexcept {
  kernels::linear(layer, x, x_stride, width, y);
  kernels::relu(y, layer.padded_rows() * width);
}

/// Products of n (a tile) with the partners that `weights` make of it, into the tile's MLP inputs.
void own_products(const Tile& t, const kernels::PackedMatrix& weights, const float* n,
                  Index stride) noexcept {
  const Index rows = t.vector_rows(), partner_rows = weights.padded_rows();
  kernels::multiply(weights, n, rows, 3 * t.width, t.s.partners.data(), partner_rows);
  kernels::partner_products(n, rows, t.s.partners.data(), partner_rows, false,
                            t.model.arch.products, t.width, t.s.mlp_input.data(), stride);
}

/// A part of the tile's MLP inputs: scalars of every point, `offset` floats into its column.
void put_scalars(const Tile& t, const float* scalars, Index offset, Index stride) noexcept {
  const Index rows = t.scalar_rows();
  for (Index p = 0; p < t.width; ++p) {
    std::copy_n(scalars + p * rows, rows, t.s.mlp_input.data() + p * stride + offset);
  }
}

/// What the points of the tile tell their neighbours; n(v) is in the scratch.
void write_messages(const Tile& t, const CollectLayer& layer, kernels::Floats& messages) noexcept {
  const Index k = layer.gate_rows(), c = t.vector_rows(), h = t.scalar_rows();
  kernels::linear(layer.gate, t.z(), h, t.width, t.s.gate.data());
  const CloudDescriptors& out = t.f.out;
  for (Index p = 0; p < t.width; ++p) {
    const Index point = t.first + p;
    const float place[3] = {out.x[point], out.y[point], out.z[point]};
    float* message = messages.data() + layer.message_length() * point;
    const float* gate = t.s.gate.data() + k * p;
    for (Index axis = 0; axis < 3; ++axis) {
      for (Index i = 0; i < k; ++i) message[axis * k + i] = place[axis] * gate[i];
      std::copy_n(t.s.normalized.data() + (axis * t.width + p) * c, c, message + 4 * k + axis * c);
    }
    std::copy_n(gate, k, message + 3 * k);
    std::copy_n(t.z() + p * h, h, message + 4 * k + 3 * c);
  }
}

/// v += collect [offsets; mean vectors] over the neighbourhood; mean scalars to `near`.
void collect(const Tile& t, const CollectLayer& layer, const kernels::Floats& messages,
             float* near) noexcept {
  const Index k = layer.gate_rows(), c = t.vector_rows(), h = t.scalar_rows();
  const CloudDescriptors& out = t.f.out;
  const kernels::Coordinates places{out.x.data(), out.y.data(), out.z.data()};
  const Index length = layer.message_length();
  kernels::collect_rows(places, out.count, t.first, t.width, layer.radius, messages.data(), length,
                        t.s.collect, t.s.message.data());
  const float inverse = 1.0f / layer.radius;
  for (Index p = 0; p < t.width; ++p) {
    const Index point = t.first + p;
    const float place[3] = {out.x[point], out.y[point], out.z[point]};
    const float* sum = t.s.message.data() + p * length;
    const float* gate = sum + 3 * k;
    for (Index axis = 0; axis < 3; ++axis) {
      float* column = t.s.collected.data() + (axis * t.width + p) * (k + c);
      for (Index i = 0; i < k; ++i) {
        column[i] = (sum[axis * k + i] - place[axis] * gate[i]) * inverse;
      }
      std::copy_n(sum + 4 * k + axis * c, c, column + k);
    }
    std::copy_n(sum + 4 * k + 3 * c, h, near + p * h);
  }
  kernels::multiply_add(layer.collect, t.s.collected.data(), k + c, 3 * t.width, t.v(), c);
}

/// Descriptors of the tile: linear, unit length, times the learned length.
void write_descriptors(const Tile& t, const PointHead& head, Index stride,
                       kernels::Floats& descriptors) noexcept {
  float* rows = descriptors.data() + stride * t.first;
  kernels::linear(head.descriptor, t.z(), t.scalar_rows(), t.width, rows);
  for (Index p = 0; p < t.width; ++p) {
    Eigen::Map<Eigen::VectorXf> row(rows + stride * p, stride);
    // torch's normalize divides by no less than this.
    row *= head.length / std::max(row.norm(), 1e-12f);
  }
}

/// Frames of the tile from n(v): vector after vector, unit Frobenius norm.
void write_frames(const Tile& t, const PointHead& head, const float* n,
                  kernels::Floats& frames) noexcept {
  const Index rows = head.frames.padded_rows(), count = t.model.arch.frames;
  float* tile = t.s.frames.data();
  kernels::multiply(head.frames, n, t.vector_rows(), 3 * t.width, tile, rows);
  for (Index p = 0; p < t.width; ++p) {
    float squared = 0;
    for (Index axis = 0; axis < 3; ++axis) {
      const float* column = tile + (axis * t.width + p) * rows;
      for (Index i = 0; i < count; ++i) squared += column[i] * column[i];
    }
    const float factor = 1.0f / std::sqrt(squared + 1e-12f);
    float* out = frames.data() + 3 * count * (t.first + p);
    for (Index i = 0; i < count; ++i) {
      for (Index axis = 0; axis < 3; ++axis) {
        *out++ = factor * tile[(axis * t.width + p) * rows + i];
      }
    }
  }
}

/// Moments to v and z1, and the messages of the first neighbourhood layer.
void run_point_stage(const Tile& t) noexcept {
  const DescriptorModel& m = t.model;
  const Index c = t.vector_rows(), h = t.scalar_rows();
  write_inputs(t);
  float* z0 = t.s.near.data();
  relu_layer(m.input_scalars, t.s.scalar_inputs.data(), padded(kernels::moment_scalars), t.width,
             z0);
  kernels::multiply(m.local_vectors, t.s.local_inputs.data(), padded(kernels::local_vectors),
                    3 * t.width, t.v(), c);
  kernels::linear(m.input_gate, z0, h, t.width, t.s.gate.data());
  for (Index axis = 0; axis < 3; ++axis) {
    Eigen::Map<Eigen::ArrayXf>(t.v() + axis * t.width * c, t.width * c) *=
        Eigen::Map<const Eigen::ArrayXf>(t.s.gate.data(), t.width * c);
  }
  kernels::lean_block(m.point_block, t.width, t.v(), t.s.normalized.data(), t.s.h.data());
  kernels::normalize_vectors(t.v(), c, m.arch.vectors, t.width, t.s.normalized.data());
  const Index stride = m.arch.products * c + h;
  own_products(t, m.point_products, t.s.normalized.data(), stride);
  put_scalars(t, z0, stride - h, stride);
  relu_layer(m.point_mlp, t.s.mlp_input.data(), stride, t.width, t.z());
  write_messages(t, m.local_collect, t.f.messages[0]);
}

/// First neighbourhood to z2, local descriptors and frames, and the messages of the second.
void run_local_stage(const Tile& t) noexcept {
  const DescriptorModel& m = t.model;
  const Index c = t.vector_rows(), h = t.scalar_rows();
  collect(t, m.local_collect, t.f.messages[0], t.s.near.data());
  for (const LeanBlock& block : m.local_blocks) {
    kernels::lean_block(block, t.width, t.v(), t.s.normalized.data(), t.s.h.data());
  }
  float* n = t.s.normalized.data();
  kernels::normalize_vectors(t.v(), c, m.arch.vectors, t.width, n);
  const Index stride = m.arch.products * c + 2 * h;
  own_products(t, m.local_products, n, stride);
  put_scalars(t, t.z(), stride - 2 * h, stride);
  put_scalars(t, t.s.near.data(), stride - h, stride);
  relu_layer(m.local_mlp[0], t.s.mlp_input.data(), stride, t.width, t.s.hidden.data());
  relu_layer(m.local_mlp[1], t.s.hidden.data(), h, t.width, t.z());
  write_descriptors(t, m.local_head, t.f.out.local_stride, t.f.out.local);
  write_frames(t, m.local_head, n, t.f.out.local_frames);
  Eigen::Map<Eigen::ArrayXf>(t.f.scalar_sums.data() + t.number() * h, h) =
      Eigen::Map<const Eigen::ArrayXXf>(t.z(), h, t.width).rowwise().sum();
  if (!t.f.kept_v.empty()) std::copy_n(t.v(), 3 * c * t.width, t.vectors(t.f.kept_v, c));

  constexpr Index context_rows = padded(kernels::context_vectors);
  kernels::multiply_add(m.context_vectors, t.vectors(t.f.context_inputs, context_rows),
                        context_rows, 3 * t.width, t.v(), c);
  kernels::normalize_vectors(t.v(), c, m.arch.vectors, t.width, n);
  write_messages(t, m.context_collect, t.f.messages[1]);
}

/// Second neighbourhood (before the first block) or the constant of the block before; then block
/// `number`, whose h is summed.
void run_context_block(const Tile& t, std::size_t number) noexcept {
  const DescriptorModel& m = t.model;
  const Index c = t.vector_rows();
  if (number == 0) {
    collect(t, m.context_collect, t.f.messages[1], t.f.near.data() + t.first * t.scalar_rows());
  } else {
    kernels::add_to_points(t.f.constant.data(), c, t.width, t.v());
  }
  kernels::lean_block(m.context_blocks[number], t.width, t.v(), t.s.normalized.data(),
                      t.s.h.data());
  kernels::sum_tile(t.s.h.data(), c, t.width, t.f.sums.data() + 3 * c * t.number());
}

/// The last block's constant, and n(v), which is summed.
void run_context_end(const Tile& t) noexcept {
  const Index c = t.vector_rows();
  kernels::add_to_points(t.f.constant.data(), c, t.width, t.v());
  float* n = t.vectors(t.f.normalized, c);
  kernels::normalize_vectors(t.v(), c, t.model.arch.vectors, t.width, n);
  kernels::sum_tile(n, c, t.width, t.f.sums.data() + 3 * c * t.number());
}

/// Context descriptors, frames and logits.
void run_heads(const Tile& t) noexcept {
  const DescriptorModel& m = t.model;
  const Index c = t.vector_rows(), h = t.scalar_rows(), p = m.arch.products;
  const float* n = t.vectors(t.f.normalized, c);
  const Index stride = 2 * p * c + 2 * h;
  own_products(t, m.context_products, n, stride);
  kernels::partner_products(n, c, t.f.partners.data(), m.context_products_pooled.padded_rows(),
                            true, p, t.width, t.s.mlp_input.data() + p * c, stride);
  put_scalars(t, t.z(), stride - 2 * h, stride);
  put_scalars(t, t.f.near.data() + t.first * h, stride - h, stride);
  kernels::multiply_bias(m.context_mlp[0].weights, t.s.mlp_input.data(), stride, t.width,
                         t.s.hidden.data(), h, t.f.mlp_constant.data(), 0, t.width);
  kernels::relu(t.s.hidden.data(), h * t.width);
  relu_layer(m.context_mlp[1], t.s.hidden.data(), h, t.width, t.z());
  write_descriptors(t, m.context_head, t.f.out.context_stride, t.f.out.context);
  write_frames(t, m.context_head, n, t.f.out.context_frames);
  kernels::linear(m.logits, t.z(), h, t.width, t.s.logits.data());
  for (Index i = 0; i < t.width; ++i) {
    const float* logits = t.s.logits.data() + i * m.logits.padded_rows();
    t.f.out.significance[t.first + i] = logits[0];
    t.f.out.overlap[t.first + i] = logits[1];
    t.f.share[t.first + i] = logits[2];
  }
}

/// features.sums to features.mean.
void pool(const DescriptorModel& model, DescriptorFeatures& f) noexcept {
  kernels::mean_of_tiles(f.sums.data(), padded(model.arch.vectors), encoded_tiles(f.out.count),
                         f.out.count, f.mean.data());
}

void pool_scalars(const DescriptorModel& model, DescriptorFeatures& f) noexcept {
  const Index h = padded(model.arch.scalars);
  const Eigen::Map<const Eigen::ArrayXXf> sums(f.scalar_sums.data(), h, encoded_tiles(f.out.count));
  Eigen::Map<Eigen::ArrayXf>(f.scalar_mean.data(), h) =
      sums.rowwise().sum() / static_cast<float>(f.out.count);
  kernels::multiply(model.context_mlp_pooled, f.scalar_mean.data(), h, 1, f.mlp_constant.data(), h);
  Eigen::Map<Eigen::ArrayXf>(f.mlp_constant.data(), h) +=
      Eigen::Map<const Eigen::ArrayXf>(model.context_mlp[0].bias.data(), h);
}

/// global = W (sum of share n(v)) + sum of share x, share = softmax of the logits.
void write_global(const DescriptorModel& model, DescriptorFeatures& f) noexcept {
  const Index c = padded(model.arch.vectors), count = f.out.count;
  Eigen::Map<Eigen::ArrayXf> share(f.share.data(), count);
  share = (share - share.maxCoeff()).exp();
  share /= share.sum();
  float centre[3] = {0, 0, 0};
  std::fill(f.mean.begin(), f.mean.end(), 0.0f);
  for (Index tile = 0; tile < encoded_tiles(count); ++tile) {
    const Index first = tile * encoded_tile, width = std::min(encoded_tile, count - first);
    for (Index axis = 0; axis < 3; ++axis) {
      const Eigen::Map<const Eigen::MatrixXf> n(
          f.normalized.data() + 3 * c * first + axis * width * c, c, width);
      Eigen::Map<Eigen::VectorXf> mean(f.mean.data() + axis * c, c);
      for (Index p = 0; p < width; ++p) mean += share[first + p] * n.col(p);
    }
  }
  const kernels::Floats* places[3] = {&f.out.x, &f.out.y, &f.out.z};
  for (Index axis = 0; axis < 3; ++axis) {
    centre[axis] = (share * Eigen::Map<const Eigen::ArrayXf>(places[axis]->data(), count)).sum();
  }
  const Index rows = f.out.global_rows;
  kernels::multiply(model.global, f.mean.data(), c, 3, f.out.global.data(), rows);
  for (Index axis = 0; axis < 3; ++axis) {
    for (Index g = 0; g < model.arch.global; ++g) f.out.global[axis * rows + g] += centre[axis];
  }
}

class Recording {
 public:
  Recording(const DescriptorModel& model, Sides sides, DescriptorWorkspace& w,
            StageRecorder& recorder)
      : model_(model), sides_(sides), w_(w), recorder_(recorder) {}

  void vectors(const char* name, kernels::Floats DescriptorFeatures::*buffer,
               Index channels) const noexcept {
    for (const Index side : sides_) {
      recorder_.vectors(side_name(side), name, (w_.features[side].*buffer).data(), padded(channels),
                        channels, w_.features[side].out.count, encoded_tile);
    }
  }
  void scalars(const char* name, kernels::Floats DescriptorFeatures::*buffer,
               Index channels) const noexcept {
    for (const Index side : sides_) {
      matrix(side, name, w_.features[side].*buffer, padded(channels), channels);
    }
  }
  void v(const char* name) const noexcept {
    vectors(name, &DescriptorFeatures::v, model_.arch.vectors);
  }
  void z(const char* name) const noexcept {
    scalars(name, &DescriptorFeatures::z, model_.arch.scalars);
  }
  void inputs() const noexcept {
    scalars("moments.scalars", &DescriptorFeatures::scalar_inputs, kernels::moment_scalars);
    vectors("moments.local", &DescriptorFeatures::local_inputs, kernels::local_vectors);
    vectors("moments.context", &DescriptorFeatures::context_inputs, kernels::context_vectors);
  }
  void results() const noexcept {
    const DescriptorArchitecture& a = model_.arch;
    for (const Index side : sides_) {
      const CloudDescriptors& out = w_.features[side].out;
      const char* prefix = side_name(side);
      recorder_.list(prefix, "encoded", out.encoded.data(), out.count);
      matrix(side, "descriptor.local", out.local, out.local_stride, a.local_descriptor);
      matrix(side, "descriptor.context", out.context, out.context_stride, a.context_descriptor);
      recorder_.list(prefix, "significance", out.significance.data(), out.count);
      recorder_.list(prefix, "overlap", out.overlap.data(), out.count);
      matrix(side, "frames.local", out.local_frames, 3 * a.frames, 3 * a.frames);
      matrix(side, "frames.context", out.context_frames, 3 * a.frames, 3 * a.frames);
      recorder_.vector(prefix, "global", out.global.data(), out.global_rows, a.global);
    }
  }

 private:
  void matrix(Index side, const char* name, const kernels::Floats& values, Index rows,
              Index channels) const noexcept {
    recorder_.matrix(side_name(side), name, values.data(), rows, channels,
                     w_.features[side].out.count);
  }

  const DescriptorModel& model_;
  Sides sides_;
  DescriptorWorkspace& w_;
  StageRecorder& recorder_;
};

}  // namespace

void encode_descriptors(const DescriptorModel& model, const Cloud clouds[2], Sides sides,
                        std::uint64_t seed, const Threads& threads, DescriptorWorkspace& w,
                        StageRecorder& recorder) noexcept {
  const Index c = padded(model.arch.vectors);
  const Pass for_each_tile(model, clouds, sides, threads, w);
  const Recording record(model, sides, w, recorder);
  for (const Index side : sides) {
    select_encoded(clouds[side], model.arch.encoded, seed, w.features[side]);
  }
  for_each_tile(run_point_stage);
  record.inputs();
  record.v("point.v");
  record.z("point.z");

  for_each_tile(run_local_stage);
  record.vectors("local.v", &DescriptorFeatures::kept_v, model.arch.vectors);
  record.z("local.z");
  for (const Index side : sides) pool_scalars(model, w.features[side]);

  for (std::size_t i = 0; i < model.context_blocks.size(); ++i) {
    for_each_tile([i](const Tile& t) { run_context_block(t, i); });
    for (const Index side : sides) {
      DescriptorFeatures& f = w.features[side];
      pool(model, f);
      kernels::multiply(model.context_blocks[i].pool, f.mean.data(), c, 3, f.constant.data(), c);
    }
  }
  for_each_tile(run_context_end);
  record.v("context.v");
  for (const Index side : sides) {
    DescriptorFeatures& f = w.features[side];
    pool(model, f);
    kernels::multiply(model.context_products_pooled, f.mean.data(), c, 3, f.partners.data(),
                      model.context_products_pooled.padded_rows());
  }
  for_each_tile(run_heads);
  for (const Index side : sides) write_global(model, w.features[side]);
  record.z("context.z");
  record.results();
}

}  // namespace vnreg::detail
