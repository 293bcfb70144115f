#include "engine/descriptor_model.hpp"

#include <initializer_list>
#include <string>

namespace vnreg::detail {
namespace {

using kernels::LeanBlock;
using kernels::Linear;
using kernels::PackedMatrix;
using kernels::padded;
using kernels::RowMajorMatrix;
using model_format::ModelFile;

Index read_index(const ModelFile& file, std::string_view key, std::uint64_t min,
                 std::uint64_t max) {
  return static_cast<Index>(file.get_u64(key, min, max));
}

float read_radius(const ModelFile& file, std::string_view key) {
  return static_cast<float>(file.get_f64(key, 0.01, 10.0));
}

void read_radii(const ModelFile& file, DescriptorArchitecture& a) {
  for (Index i = 0; i < kernels::moment_radii; ++i) {
    a.moment_radii[i] = read_radius(file, "moments.radius." + std::to_string(i));
  }
  a.local_radius = read_radius(file, "neighbourhood.local");
  a.context_radius = read_radius(file, "neighbourhood.context");
}

DescriptorArchitecture read_parameters(const ModelFile& file) {
  constexpr std::uint64_t most = 512;
  DescriptorArchitecture a;
  a.vectors = read_index(file, "channels.vector", 1, most);
  a.scalars = read_index(file, "channels.scalar", 1, most);
  a.gates = read_index(file, "channels.gate", 1, most);
  a.products = read_index(file, "channels.product", 1, 16);
  a.local_descriptor = read_index(file, "channels.local_descriptor", 1, most);
  a.context_descriptor = read_index(file, "channels.context_descriptor", 1, most);
  a.frames = read_index(file, "channels.frame", 1, most);
  a.global = read_index(file, "channels.global", 4, most);
  a.local_blocks = read_index(file, "blocks.local", 1, 8);
  a.context_blocks = read_index(file, "blocks.context", 1, 8);
  a.encoded = read_index(file, "input.encoded", 24, 4096);
  read_radii(file, a);
  return a;
}

/// A part of the input of a layer: `columns` of the stored matrix, in groups of which every one is
/// padded to whole packets.
struct Part {
  Index columns;
  Index group;
};

/// Spreads the columns of a stored matrix over the padded parts of a column of features.
RowMajorMatrix pad_parts(const RowMajorMatrix& w, std::initializer_list<Part> parts) {
  Index size = 0;
  for (const Part& part : parts) size += part.columns / part.group * padded(part.group);
  RowMajorMatrix out = RowMajorMatrix::Zero(w.rows(), size);
  Index from = 0;
  Index to = 0;
  for (const Part& part : parts) {
    for (Index done = 0; done < part.columns; done += part.group) {
      out.middleCols(to, part.group) = w.middleCols(from, part.group);
      from += part.group;
      to += padded(part.group);
    }
  }
  return out;
}

/// The stored order of the products is channel by channel, the features' partner by partner.
void sort_products(RowMajorMatrix& w, Index channels, Index partners) {
  const RowMajorMatrix stored = w.leftCols(channels * partners);
  for (Index c = 0; c < channels; ++c) {
    for (Index p = 0; p < partners; ++p) w.col(p * channels + c) = stored.col(c * partners + p);
  }
}

/// A layer on [products; scalars; ...]: `others` parts of H scalars follow `partners` x C products.
Linear read_product_layer(TensorSet& tensors, const DescriptorArchitecture& a,
                          const std::string& name, Index partners, Index others) {
  const Index products = a.vectors * partners;
  const Index scalars = others * a.scalars;
  RowMajorMatrix w = tensors.dense(name + ".weight", a.scalars, products + scalars);
  sort_products(w, a.vectors, partners);
  return {pad_parts(w, {{products, a.vectors}, {scalars, a.scalars}}),
          tensors.vector(name + ".bias", a.scalars)};
}

LeanBlock read_block(TensorSet& tensors, Index channels, const std::string& name, bool pooled) {
  LeanBlock block{tensors.packed(name + ".direction", channels, channels),
                  tensors.packed(name + ".linear", channels, channels), PackedMatrix{}};
  if (pooled) block.pool = tensors.packed(name + ".pool", channels, channels);
  return block;
}

std::vector<LeanBlock> read_blocks(TensorSet& tensors, Index channels, const std::string& name,
                                   Index count, bool pooled) {
  std::vector<LeanBlock> blocks;
  for (Index i = 0; i < count; ++i) {
    blocks.push_back(read_block(tensors, channels, name + "." + std::to_string(i), pooled));
  }
  return blocks;
}

CollectLayer read_collect(TensorSet& tensors, const DescriptorArchitecture& a,
                          const std::string& stage, float radius) {
  const RowMajorMatrix w = tensors.dense(stage + ".collect", a.vectors, a.gates + a.vectors);
  return {radius, tensors.linear(stage + ".gate", a.gates, a.scalars),
          PackedMatrix(pad_parts(w, {{a.gates, a.gates}, {a.vectors, a.vectors}}))};
}

PointHead read_head(TensorSet& tensors, const DescriptorArchitecture& a, const std::string& stage,
                    Index descriptor, float length) {
  return {tensors.linear(stage + ".descriptor", descriptor, a.scalars), length,
          tensors.packed(stage + ".frames", a.frames, a.vectors)};
}

void read_point_stage(TensorSet& tensors, DescriptorModel& m) {
  const DescriptorArchitecture& a = m.arch;
  m.input_scalars = tensors.linear("point.scalars", a.scalars, kernels::moment_scalars);
  m.local_vectors = tensors.packed("point.vectors", a.vectors, kernels::local_vectors);
  m.input_gate = tensors.linear("point.gate", a.vectors, a.scalars);
  m.point_block = read_block(tensors, a.vectors, "point.block", false);
  m.point_products = tensors.packed("point.products", a.products, a.vectors);
  m.point_mlp = read_product_layer(tensors, a, "point.mlp", a.products, 1);
}

void read_local_stage(TensorSet& tensors, DescriptorModel& m, float length) {
  const DescriptorArchitecture& a = m.arch;
  m.local_collect = read_collect(tensors, a, "local", a.local_radius);
  m.local_blocks = read_blocks(tensors, a.vectors, "local.block", a.local_blocks, false);
  m.local_products = tensors.packed("local.products", a.products, a.vectors);
  m.local_mlp[0] = read_product_layer(tensors, a, "local.mlp.0", a.products, 2);
  m.local_mlp[1] = tensors.linear("local.mlp.1", a.scalars, a.scalars);
  m.local_head = read_head(tensors, a, "local", a.local_descriptor, length);
}

/// The last H columns of context.mlp.0 take the mean scalars, equal for all points of a cloud.
void read_context_mlp(TensorSet& tensors, DescriptorModel& m) {
  const DescriptorArchitecture& a = m.arch;
  const Index products = 2 * a.products * a.vectors;
  RowMajorMatrix w = tensors.dense("context.mlp.0.weight", a.scalars, products + 3 * a.scalars);
  m.context_mlp_pooled = PackedMatrix(w.rightCols(a.scalars));
  sort_products(w, a.vectors, 2 * a.products);
  m.context_mlp[0] = {pad_parts(w, {{products, a.vectors}, {2 * a.scalars, a.scalars}}),
                      tensors.vector("context.mlp.0.bias", a.scalars)};
  m.context_mlp[1] = tensors.linear("context.mlp.1", a.scalars, a.scalars);
}

void read_context_stage(TensorSet& tensors, DescriptorModel& m, float length) {
  const DescriptorArchitecture& a = m.arch;
  m.context_vectors = tensors.packed("context.vectors", a.vectors, kernels::context_vectors);
  m.context_collect = read_collect(tensors, a, "context", a.context_radius);
  m.context_blocks = read_blocks(tensors, a.vectors, "context.block", a.context_blocks, true);
  m.context_products = tensors.packed("context.products", a.products, a.vectors);
  m.context_products_pooled = tensors.packed("context.products_pooled", a.products, a.vectors);
  read_context_mlp(tensors, m);
  m.context_head = read_head(tensors, a, "context", a.context_descriptor, length);
  m.logits = tensors.linear("context.logits", 3, a.scalars);
  m.global = tensors.packed("context.global", a.global, a.vectors);
}

}  // namespace

DescriptorModel read_descriptor_model(const ModelFile& file, TensorSet& tensors) {
  DescriptorModel m;
  m.arch = read_parameters(file);
  const std::span<const float> lengths = tensors.vector("lengths", 2);
  read_point_stage(tensors, m);
  read_local_stage(tensors, m, lengths[0]);
  read_context_stage(tensors, m, lengths[1]);
  return m;
}

}  // namespace vnreg::detail
