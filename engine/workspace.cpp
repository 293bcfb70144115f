#include "engine/workspace.hpp"

#include <algorithm>

namespace vnreg::detail {
namespace {

using kernels::padded;

void allocate(Floats& buffer, Index size) { buffer.assign(static_cast<std::size_t>(size), 0.0f); }

void allocate_encoder(const ModelData& model, Index points, Features& f) {
  const Index c = padded(model.arch.channels_global);
  const Index widest = std::max(c, padded(model.arch.channels_local));
  const Index rows = std::max(
      {widest, model.encoder.network1[1].tail.hidden_rows(), model.network2[0].out_rows()});
  allocate(f.edges, 9 * points);
  allocate(f.latent, 3 * c * points);
  allocate(f.other, 3 * widest * points);
  allocate(f.sums, 3 * rows * tile_count(points));
  for (Floats* buffer :
       {&f.mean, &f.hidden_mean, &f.pooled, &f.direction, &f.global, &f.local_global}) {
    allocate(*buffer, 3 * rows);
  }
  // An encoder of the local module's own has the same widths.
  for (const auto* blocks :
       {&model.encoder.network0_rest, &model.encoder.network1, &model.network2}) {
    for (const kernels::VnBlock& block : *blocks) f.constants.reserve(block);
  }
}

void allocate_local(const ModelData& model, Index points, bool record, Features& f) {
  allocate(f.descriptors, model.descriptor.padded_rows() * points);
  allocate(f.significance, points);
  if (record) {
    allocate(f.local, 3 * model.network2[1].out_rows() * points);
    allocate(f.frame, 3 * frame_rows * points);
  }
}

void allocate_kept(const ModelData& model, Index points, KeptPoints& k) {
  const Index kept = points / model.arch.keep_divisor;
  k.keys.resize(static_cast<std::size_t>(points));
  k.original.resize(static_cast<std::size_t>(kept));
  for (Floats* axis : {&k.x, &k.y, &k.z}) allocate(*axis, kept);
  allocate(k.descriptors, model.descriptor.padded_rows() * kept);
  allocate(k.parts, model.pair.rows * kept);
}

void allocate_fine(const ModelData& model, Index points, Index similarity_rows, FineBuffers& f) {
  const Index kept = points / model.arch.keep_divisor;
  for (KeptPoints& k : f.kept) allocate_kept(model, points, k);
  for (Floats* axis : {&f.moved_x, &f.moved_y, &f.moved_z, &f.matched_x, &f.matched_y, &f.matched_z,
                       &f.weights, &f.sorted_weights}) {
    allocate(*axis, kept);
  }
  f.match.resize(static_cast<std::size_t>(kept));
  allocate(f.row_maxima, model.pair.rows * kept);
  allocate(f.weight_hidden, model.weight[0].padded_rows() * kept);
  allocate(f.weight_rows, model.weight[1].padded_rows() * kept);
  allocate(f.similarity, similarity_rows * kept);
}

void allocate_residual(Index points, ResidualBuffers& r) {
  for (Index side = 0; side < 2; ++side) {
    for (Floats* buffer :
         {&r.moved_x[side], &r.moved_y[side], &r.moved_z[side], &r.squared[side]}) {
      allocate(*buffer, points);
    }
  }
  allocate(r.spacing, points);
}

void allocate_encoder_scratch(const ModelData& model, ThreadScratch& s) {
  const kernels::EdgeBlock& first = model.encoder.network0_first;
  s.block.reserve(first.half, first.tail, tile_points);
  // An encoder of the local module's own has the same widths.
  for (const auto* blocks :
       {&model.encoder.network0_rest, &model.encoder.network1, &model.network2}) {
    for (const kernels::VnBlock& block : *blocks) {
      s.block.reserve(block.half, block.tail, tile_points);
    }
  }
}

void allocate_local_scratch(const ModelData& model, ThreadScratch& s) {
  constexpr Index columns = 3 * tile_points;
  const Index l = model.network2[1].out_rows();
  allocate(s.local, l * columns);
  allocate(s.projected, model.invariant[0].out_rows() * columns);
  allocate(s.direction, kernels::packet_size * columns);
  for (std::size_t i = 0; i < 2; ++i) {
    allocate(s.invariant[i], model.invariant[i].out_rows() * columns);
  }
  allocate(s.frame, frame_rows * columns);
  allocate(s.products, 3 * l * tile_points);
  for (std::size_t i = 0; i < 3; ++i) {
    allocate(s.mlp[i], model.significance[i].padded_rows() * tile_points);
  }
  s.pairs = kernels::PairScratch(model.pair);
}

/// Mode verified takes the fine register's pose where the model has one.
bool has_fine_register(const ModelData& model, const Options& options) noexcept {
  return options.mode != Mode::coarse && model.arch.fine_iterations > 0;
}

void allocate_paper(const ModelData& model, const Options& options, Index max_points,
                    Workspace& w) {
  for (Features& f : w.features) {
    allocate_encoder(model, max_points, f);
    if (w.local) allocate_local(model, max_points, options.record_stages, f);
  }
  for (ThreadScratch& s : w.scratch) {
    allocate_encoder_scratch(model, s);
    if (w.local) allocate_local_scratch(model, s);
  }
  if (w.local) {
    const Index kept = max_points / model.arch.keep_divisor;
    allocate_fine(model, max_points, options.record_stages ? kept : w.threads, w.fine);
  }
}

}  // namespace

Workspace::Workspace(const ModelData& model, const Options& options, Index max_points)
    : threads{thread_count(options.threads), &deadline},
      local(has_fine_register(model, options)),
      recorder(options.record_stages) {
  scratch.resize(static_cast<std::size_t>(threads.count));
  for (Cloud& c : cloud) c = Cloud(max_points);
  for (ThreadScratch& s : scratch) s.neighbours = kernels::NeighbourScratch(max_points);
  if (model.descriptor_model) {
    descriptors =
        DescriptorWorkspace(*model.descriptor_model, max_points, threads, options.record_stages);
    for (Features& f : features) allocate(f.global, 3 * padded(model.arch.channels_global));
  } else {
    allocate_paper(model, options, max_points, *this);
  }
  allocate_residual(max_points, residual);
  if (options.mode == Mode::verified) {
    const Index encoded =
        model.descriptor_model ? std::min(max_points, model.descriptor_model->arch.encoded) : 0;
    verified = VerifiedWorkspace(max_points, encoded);
    if (model.descriptor_model) {
      verified.judge = JudgeWorkspace(model.judge ? &*model.judge : nullptr, max_points, encoded,
                                      threads, options.record_stages);
    }
  }
  // The runtime makes its threads at the first parallel region: now, not in the first align.
  parallel_for(threads.count, threads.count, [](Index, int) {});
}

}  // namespace vnreg::detail
