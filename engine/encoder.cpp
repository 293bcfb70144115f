#include "engine/encoder.hpp"

#include <algorithm>

#include "engine/neighbourhood.hpp"
#include "kernels/mean_pool.hpp"
#include "kernels/vn_relu.hpp"

namespace vnreg::detail {
namespace {

using kernels::VnBlock;

/// Where tile `tile` of a feature buffer with `rows` rows starts.
template <class Scalar>
Scalar* tile_of(Scalar* buffer, Index rows, Index tile) noexcept {
  return buffer + 3 * rows * tile * tile_points;
}

Index tile_width(const Cloud& cloud, Index tile) noexcept {
  return std::min(tile_points, cloud.count - tile * tile_points);
}

float* tile_sums(Features& f, Index rows, Index tile) noexcept {
  return f.sums.data() + 3 * rows * tile;
}

/// One pass of a block over both clouds, from one feature buffer to another, whose sums go to
/// features.sums. The constants of the block must be set.
void run_block(const VnBlock& block, Floats Features::*from, Floats Features::*to,
               Workspace& w) noexcept {
  w.for_each_tile([&](Index side, Index tile, ThreadScratch& scratch) {
    Features& f = w.features[side];
    const Index width = tile_width(w.cloud[side], tile);
    const Index rows = block.out_rows();
    float* out = tile_of((f.*to).data(), rows, tile);
    kernels::vn_block(block, f.constants, tile_of((f.*from).data(), block.half, tile), width,
                      scratch.block, out);
    kernels::sum_tile(out, rows, width, tile_sums(f, rows, tile));
  });
}

/// features.sums to features.mean, and on to the constants of the next block.
void pool(Index rows, const VnBlock& next, Workspace& w) noexcept {
  for (const Index side : w.sides) {
    Features& f = w.features[side];
    const Index points = w.cloud[side].count;
    kernels::mean_of_tiles(f.sums.data(), rows, tile_count(points), points, f.mean.data());
    kernels::set_constants(next, f.mean.data(), f.constants);
  }
}

void record(const char* name, Floats Features::*buffer, Index channels, Workspace& w) noexcept {
  for (const Index side : w.sides) {
    w.recorder.vectors(side_name(side), name, (w.features[side].*buffer).data(),
                       kernels::padded(channels), channels, w.cloud[side].count, tile_points);
  }
}

/// The first block of network 0, from the edge vectors.
void run_first_block(const kernels::EdgeBlock& block, Workspace& w) noexcept {
  w.for_each_tile([&](Index side, Index tile, ThreadScratch& scratch) {
    Features& f = w.features[side];
    const Index width = tile_width(w.cloud[side], tile);
    const Index rows = block.out_rows();
    float* out = tile_of(f.latent.data(), rows, tile);
    kernels::edge_block(block, tile_of(f.edges.data(), 3, tile), width, scratch.block, out);
    kernels::sum_tile(out, rows, width, tile_sums(f, rows, tile));
  });
}

/// The last block before the mean pool, whose linear maps move behind it: the mean over points of
/// S [v; m] + F1 h is S [mean v; m] + F1 mean h. Result: features.pooled.
void run_pooled_block(const VnBlock& block, Workspace& w) noexcept {
  const Index hidden = block.tail.hidden_rows();
  w.for_each_tile([&](Index side, Index tile, ThreadScratch& scratch) {
    Features& f = w.features[side];
    const Index width = tile_width(w.cloud[side], tile);
    kernels::vn_block_hidden(block, f.constants, tile_of(f.other.data(), block.half, tile), width,
                             scratch.block);
    kernels::sum_tile(scratch.block.activated_hidden.data(), hidden, width,
                      tile_sums(f, hidden, tile));
  });
  for (const Index side : w.sides) {
    Features& f = w.features[side];
    const Index points = w.cloud[side].count;
    const Index rows = block.out_rows();
    kernels::mean_of_tiles(f.sums.data(), hidden, tile_count(points), points, f.hidden_mean.data());
    kernels::multiply_bias(block.shortcut_v, f.mean.data(), block.half, 3, f.pooled.data(), rows,
                           f.constants.shortcut.data(), rows, 1);
    kernels::multiply_add(block.tail.fc1, f.hidden_mean.data(), hidden, 3, f.pooled.data(), rows);
  }
}

/// `to` = VN-linear(VN-ReLU(features.pooled)).
void run_global_head(const EncoderData& encoder, const Architecture& arch, Floats Features::*to,
                     Workspace& w) noexcept {
  const Index rows = kernels::padded(arch.channels_global);
  for (const Index side : w.sides) {
    Features& f = w.features[side];
    const Index direction_rows = encoder.global_direction.padded_rows();
    const auto pooled = kernels::tile_view<const float>(f.pooled.data(), rows, 1);
    const auto direction = kernels::tile_view(f.direction.data(), direction_rows, 1);
    kernels::multiply(encoder.global_direction, f.pooled.data(), rows, 3, f.direction.data(),
                      direction_rows);
    const float* activated = f.direction.data();
    if (arch.shared_direction) {
      kernels::vn_relu_shared(1, rows, pooled,
                              {direction.data, direction.point_stride, direction.component_stride},
                              kernels::tile_view(f.pooled.data(), rows, 1));
      activated = f.pooled.data();
    } else {
      kernels::vn_relu(1, rows, pooled, direction);
    }
    kernels::multiply(encoder.global_fc, activated, rows, 3, (f.*to).data(), rows);
  }
}

/// The significance MLP on the descriptors of a tile.
void run_significance(const ModelData& model, const float* descriptors, Index width,
                      ThreadScratch& scratch, float* significance) noexcept {
  const float* x = descriptors;
  Index x_rows = model.descriptor.padded_rows();
  for (std::size_t i = 0; i < 3; ++i) {
    const kernels::Linear& layer = model.significance[i];
    float* y = scratch.mlp[i].data();
    kernels::linear(layer, x, x_rows, width, y);
    if (i < 2) kernels::relu(y, layer.padded_rows() * width);
    x = y;
    x_rows = layer.padded_rows();
  }
  for (Index p = 0; p < width; ++p) significance[p] = x[p * x_rows];
}

/// From the local features of a tile to its frames.
void run_invariant_layer(const ModelData& model, const float* local, Index width,
                         ThreadScratch& s) noexcept {
  const float* v = local;
  Index v_rows = model.network2[1].out_rows();
  for (std::size_t i = 0; i < 2; ++i) {
    const kernels::VnNormLayer& layer = model.invariant[i];
    kernels::vn_norm_layer(layer, v, v_rows, width, s.projected.data(), s.direction.data(),
                           s.invariant[i].data());
    v = s.invariant[i].data();
    v_rows = layer.out_rows();
  }
  kernels::multiply(model.frame, v, v_rows, 3 * width, s.frame.data(), frame_rows);
}

/// The frame of a model without invariant layer: the products with it are the vectors themselves.
void set_identity_frame(Index width, ThreadScratch& s) noexcept {
  std::fill_n(s.frame.begin(), 3 * frame_rows * width, 0.0f);
  for (Index axis = 0; axis < 3; ++axis) {
    float* columns = s.frame.data() + axis * width * frame_rows;
    for (Index p = 0; p < width; ++p) columns[p * frame_rows + axis] = 1.0f;
  }
}

/// From the local features of a tile to its descriptors.
void describe(const ModelData& model, const float* local, Index width, ThreadScratch& s,
              float* descriptors) noexcept {
  const Index local_rows = model.network2[1].out_rows();
  if (model.arch.invariant_layer) {
    run_invariant_layer(model, local, width, s);
  } else {
    set_identity_frame(width, s);
  }
  kernels::invariant_products(local, local_rows, s.frame.data(), frame_rows, width,
                              s.products.data());
  kernels::linear(model.descriptor, s.products.data(), 3 * local_rows, width, descriptors);
  kernels::relu(descriptors, model.descriptor.padded_rows() * width);
}

/// The last block of network 2 and all layers behind it, while a tile's features are in the cache.
void run_last_local_block(const ModelData& model, Workspace& w) noexcept {
  const VnBlock& block = model.network2[1];
  w.for_each_tile([&](Index side, Index tile, ThreadScratch& scratch) {
    Features& f = w.features[side];
    const Index width = tile_width(w.cloud[side], tile);
    const Index first = tile * tile_points;
    float* descriptors = f.descriptors.data() + first * model.descriptor.padded_rows();
    kernels::vn_block(block, f.constants, tile_of(f.other.data(), block.half, tile), width,
                      scratch.block, scratch.local.data());
    describe(model, scratch.local.data(), width, scratch, descriptors);
    run_significance(model, descriptors, width, scratch, f.significance.data() + first);
    if (w.recorder.enabled()) {
      std::copy_n(scratch.frame.data(), 3 * frame_rows * width,
                  tile_of(f.frame.data(), frame_rows, tile));
      std::copy_n(scratch.local.data(), 3 * block.out_rows() * width,
                  tile_of(f.local.data(), block.out_rows(), tile));
    }
  });
}

void record_local_stages(const ModelData& model, Workspace& w) noexcept {
  const Architecture& a = model.arch;
  record("network2.block1", &Features::local, a.channels_local, w);
  record("frame", &Features::frame, 3, w);
  for (const Index side : w.sides) {
    const Features& f = w.features[side];
    const Index points = w.cloud[side].count;
    w.recorder.matrix(side_name(side), "descriptor", f.descriptors.data(),
                      model.descriptor.padded_rows(), a.channels_descriptor, points);
    w.recorder.list(side_name(side), "significance", f.significance.data(), points);
  }
}

/// The encoder, from the edges to features.latent and the global feature in `to`. Of an encoder of
/// the local module's own no stage is recorded: they would have the shared one's names.
void run_encoder(const EncoderData& encoder, const Architecture& arch, Floats Features::*to,
                 Workspace& w) noexcept {
  const bool recorded = to == &Features::global;
  const Index channels = arch.channels_global;
  const Index rows = kernels::padded(channels);
  const auto record_block = [&](const char* name, Floats Features::*buffer) {
    if (recorded) record(name, buffer, channels, w);
  };
  run_first_block(encoder.network0_first, w);
  record_block("network0.block0", &Features::latent);
  pool(rows, encoder.network0_rest[0], w);
  run_block(encoder.network0_rest[0], &Features::latent, &Features::other, w);
  record_block("network0.block1", &Features::other);
  pool(rows, encoder.network0_rest[1], w);
  run_block(encoder.network0_rest[1], &Features::other, &Features::latent, w);
  record_block("network0.block2", &Features::latent);
  pool(rows, encoder.network1[0], w);
  run_block(encoder.network1[0], &Features::latent, &Features::other, w);
  record_block("network1.block0", &Features::other);
  pool(rows, encoder.network1[1], w);
  run_pooled_block(encoder.network1[1], w);
  run_global_head(encoder, arch, to, w);
}

}  // namespace

void encode_global(const ModelData& model, Workspace& w) noexcept {
  find_edges(w);
  run_encoder(model.encoder, model.arch, &Features::global, w);
  const Index channels = model.arch.channels_global;
  for (const Index side : w.sides) {
    w.recorder.vector(side_name(side), "global", w.features[side].global.data(),
                      kernels::padded(channels), channels);
  }
}

void encode_local(const ModelData& model, Workspace& w) noexcept {
  const Index channels = model.arch.channels_local;
  Floats Features::*global = &Features::global;
  if (model.local_encoder) {
    global = &Features::local_global;
    run_encoder(*model.local_encoder, model.arch, global, w);
  }
  for (const Index side : w.sides) {
    Features& f = w.features[side];
    kernels::set_constants(model.network2[0], (f.*global).data(), f.constants);
  }
  run_block(model.network2[0], &Features::latent, &Features::other, w);
  record("network2.block0", &Features::other, channels, w);
  pool(kernels::padded(channels), model.network2[1], w);
  run_last_local_block(model, w);
  record_local_stages(model, w);
}

}  // namespace vnreg::detail
