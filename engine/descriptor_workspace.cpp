#include "engine/descriptor_workspace.hpp"

#include <algorithm>

namespace vnreg::detail {
namespace {

using kernels::Floats;
using kernels::padded;

void allocate(Floats& buffer, Index size) { buffer.assign(static_cast<std::size_t>(size), 0.0f); }

void allocate_features(const DescriptorModel& model, Index encoded, Index max_points, bool record,
                       DescriptorFeatures& f) {
  const DescriptorArchitecture& a = model.arch;
  const Index c = padded(a.vectors), h = padded(a.scalars), tiles = encoded_tiles(encoded);
  f.out = CloudDescriptors(a, encoded);
  f.keys.resize(static_cast<std::size_t>(max_points));
  allocate(f.context_inputs, padded(kernels::context_vectors) * 3 * encoded);
  for (Floats* vectors : {&f.v, &f.normalized}) allocate(*vectors, c * 3 * encoded);
  for (Floats* scalars : {&f.z, &f.near}) allocate(*scalars, h * encoded);
  if (record) {
    allocate(f.local_inputs, padded(kernels::local_vectors) * 3 * encoded);
    allocate(f.scalar_inputs, padded(kernels::moment_scalars) * encoded);
    allocate(f.kept_v, c * 3 * encoded);
  }
  allocate(f.messages[0], model.local_collect.message_length() * encoded);
  allocate(f.messages[1], model.context_collect.message_length() * encoded);
  allocate(f.sums, c * 3 * tiles);
  allocate(f.scalar_sums, h * tiles);
  for (Floats* vectors : {&f.mean, &f.constant}) allocate(*vectors, c * 3);
  for (Floats* scalars : {&f.scalar_mean, &f.mlp_constant}) allocate(*scalars, h);
  allocate(f.partners, 3 * padded(a.products));
  allocate(f.share, encoded);
}

void allocate_scratch(const DescriptorModel& model, Index encoded, Index max_points,
                      DescriptorScratch& s) {
  const DescriptorArchitecture& a = model.arch;
  const Index c = padded(a.vectors), h = padded(a.scalars), k = padded(a.gates);
  constexpr Index points = encoded_tile, columns = 3 * encoded_tile;
  allocate(s.leaf_bounds, max_points);
  s.collect = kernels::CollectScratch(encoded);
  allocate(s.local_inputs, padded(kernels::local_vectors) * columns);
  allocate(s.scalar_inputs, padded(kernels::moment_scalars) * points);
  allocate(s.gate, std::max(c, k) * points);
  for (Floats* vectors : {&s.normalized, &s.h}) allocate(*vectors, c * columns);
  allocate(s.message, points * std::max(model.local_collect.message_length(),
                                        model.context_collect.message_length()));
  allocate(s.collected, (k + c) * columns);
  allocate(s.near, h * points);
  allocate(s.partners, padded(a.products) * columns);
  allocate(s.mlp_input, (2 * a.products * c + 2 * h) * points);
  allocate(s.hidden, h * points);
  allocate(s.frames, padded(a.frames) * columns);
  allocate(s.logits, padded(3) * points);
}

}  // namespace

CloudDescriptors::CloudDescriptors(const DescriptorArchitecture& arch, Index max_encoded)
    : encoded(static_cast<std::size_t>(max_encoded)),
      local_stride(padded(arch.local_descriptor)),
      context_stride(padded(arch.context_descriptor)),
      frames(arch.frames),
      global_rows(padded(arch.global)) {
  for (Floats* list : {&x, &y, &z, &significance, &overlap}) allocate(*list, max_encoded);
  allocate(local, local_stride * max_encoded);
  allocate(context, context_stride * max_encoded);
  for (Floats* vectors : {&local_frames, &context_frames}) {
    allocate(*vectors, 3 * frames * max_encoded);
  }
  allocate(covariance, 6 * max_encoded);
  allocate(global, 3 * global_rows);
}

DescriptorWorkspace::DescriptorWorkspace(const DescriptorModel& model, Index max_points,
                                         int threads, bool record)
    : scratch(static_cast<std::size_t>(threads)) {
  const Index encoded = std::min(model.arch.encoded, max_points);
  for (DescriptorFeatures& f : features) {
    allocate_features(model, encoded, max_points, record, f);
  }
  for (DescriptorScratch& s : scratch) allocate_scratch(model, encoded, max_points, s);
}

}  // namespace vnreg::detail
