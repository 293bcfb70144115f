#include "engine/model_data.hpp"

#include <string>

#include "engine/read_model_data.hpp"
#include "engine/tensor_set.hpp"

namespace vnreg::detail {
namespace {

using kernels::RowMajorMatrix;
using model_format::ModelFile;

/// Rows of a direction matrix: one per channel, or one for all.
Index direction_rows(const Architecture& arch, Index channels) {
  return arch.shared_direction ? 1 : channels;
}

kernels::VnBlockTensors read_block(TensorSet& tensors, const Architecture& arch,
                                   const std::string& name, Index in, Index out) {
  kernels::VnBlockTensors t;
  t.in = in;
  t.out = out;
  t.shared_direction = arch.shared_direction;
  const Index hidden = t.hidden();
  t.relu0 = tensors.matrix(name + ".relu0", direction_rows(arch, in), in);
  t.fc0 = tensors.matrix(name + ".fc0", hidden, in);
  t.relu1 = tensors.matrix(name + ".relu1", direction_rows(arch, hidden), hidden);
  t.fc1 = tensors.matrix(name + ".fc1", out, hidden);
  if (in != out) t.shortcut = tensors.matrix(name + ".shortcut", out, in);
  return t;
}

EncoderData read_encoder(TensorSet& tensors, const Architecture& a, const std::string& prefix) {
  EncoderData e;
  const Index c = a.channels_global;
  // Tensors are asked for one after the other, never as arguments of one call, whose order is the
  // compiler's choice: of two that are wrong, every build names the same.
  const std::span<const float> pre = tensors.matrix(prefix + ".pre", 2 * c, 3);
  e.network0_first =
      kernels::make_edge_block(pre, read_block(tensors, a, prefix + ".network0.0", 2 * c, c));
  const std::string network1 = prefix + ".network1.";
  for (std::size_t i = 0; i < 2; ++i) {
    e.network0_rest[i] = kernels::make_vn_block(
        read_block(tensors, a, prefix + ".network0." + std::to_string(i + 1), 2 * c, c));
    e.network1[i] =
        kernels::make_vn_block(read_block(tensors, a, network1 + std::to_string(i), 2 * c, c));
  }
  e.global_direction = tensors.packed(prefix + ".global.relu", direction_rows(a, c), c);
  e.global_fc = tensors.packed(prefix + ".global.fc", c, c);
  return e;
}

void read_invariant_layer(TensorSet& tensors, ModelData& m) {
  const Architecture& a = m.arch;
  const Index l = a.channels_local;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string name = "local.invariant." + std::to_string(i);
    const Index in = i == 0 ? l : l / 2;
    const Index out = in / 2;
    const RowMajorMatrix fc = tensors.dense(name + ".fc", out, in);
    const RowMajorMatrix direction = tensors.dense(name + ".direction", direction_rows(a, out), in);
    const std::span<const float> scale = tensors.vector(name + ".scale", out);
    const std::span<const float> shift = tensors.vector(name + ".shift", out);
    m.invariant[i] = kernels::make_vn_norm_layer(fc, direction, scale, shift, a.shared_direction);
  }
  m.frame = tensors.packed("local.invariant.2.fc", 3, l / 4);
}

void read_local_module(TensorSet& tensors, ModelData& m) {
  const Architecture& a = m.arch;
  const Index l = a.channels_local;
  m.network2[0] =
      make_vn_block(read_block(tensors, a, "local.network2.0", 2 * a.channels_global, l));
  m.network2[1] = kernels::make_vn_block(read_block(tensors, a, "local.network2.1", 2 * l, l));
  if (a.invariant_layer) read_invariant_layer(tensors, m);
  const RowMajorMatrix weight =
      tensors.dense("local.descriptor.weight", a.channels_descriptor, 3 * l);
  m.descriptor = kernels::make_descriptor_layer(
      weight, tensors.vector("local.descriptor.bias", a.channels_descriptor), l);
}

void read_fine_register(TensorSet& tensors, ModelData& m) {
  const Architecture& a = m.arch;
  const Index d = a.channels_descriptor;
  const Index p = a.channels_pair;
  m.significance[0] = tensors.linear("fine.significance.0", a.channels_significance[0], d);
  m.significance[1] =
      tensors.linear("fine.significance.1", a.channels_significance[1], a.channels_significance[0]);
  m.significance[2] = tensors.linear("fine.significance.2", 1, a.channels_significance[1]);
  m.weight[0] = tensors.linear("fine.weight.0", p, p);
  m.weight[1] = tensors.linear("fine.weight.1", 1, p);
  m.pair = kernels::make_pair_layer({
      .descriptor = d,
      .pair = p,
      .weight0 = tensors.matrix("fine.pair.0.weight", p, 2 * d + 4),
      .bias0 = tensors.vector("fine.pair.0.bias", p),
      .weight1 = tensors.matrix("fine.pair.1.weight", p, p),
      .bias1 = tensors.vector("fine.pair.1.bias", p),
      .similarity_weight0 = tensors.matrix("fine.similarity.0.weight", p, p),
      .similarity_bias0 = tensors.vector("fine.similarity.0.bias", p),
      .similarity_weight1 = tensors.matrix("fine.similarity.1.weight", 1, p),
      .similarity_bias1 = tensors.vector("fine.similarity.1.bias", 1),
  });
}

}  // namespace

std::shared_ptr<const ModelData> read_model_data(const ModelFile& file) {
  auto model = std::make_shared<ModelData>();
  model->arch = read_architecture(file);
  model->calibration = read_calibration(file);
  model->verified_calibration = read_verified_calibration(file);
  model->covariance_inflation = read_covariance_inflation(file);
  TensorSet tensors(file);
  if (model->arch.family == Family::vnreg) {
    model->descriptor_model = read_descriptor_model(file, tensors);
    model->judge = read_judge_model(file, tensors);
    tensors.refuse_others("vnreg");
    return model;
  }
  model->encoder = read_encoder(tensors, model->arch, "encoder");
  if (!model->arch.shared_encoder) {
    model->local_encoder = read_encoder(tensors, model->arch, "local.encoder");
  }
  read_local_module(tensors, *model);
  read_fine_register(tensors, *model);
  tensors.refuse_others("paper");
  return model;
}

}  // namespace vnreg::detail
