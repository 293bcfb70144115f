#include "engine/fine.hpp"

#include <algorithm>
#include <string>

#include "engine/rigid.hpp"
#include "kernels/top_k.hpp"

namespace vnreg::detail {
namespace {

using kernels::Coordinates;
using kernels::RigidTransform;

Coordinates coordinates_of(const Floats& x, const Floats& y, const Floats& z) noexcept {
  return {x.data(), y.data(), z.data()};
}

/// Hard elimination: the N / keep_divisor points of largest significance.
void eliminate(const ModelData& model, const Cloud& cloud, const Features& f,
               KeptPoints& kept) noexcept {
  kept.count = cloud.count / model.arch.keep_divisor;
  const auto points = static_cast<std::size_t>(cloud.count);
  kernels::top_k({f.significance.data(), points}, kept.keys,
                 {kept.original.data(), static_cast<std::size_t>(kept.count)});
  const Index rows = model.descriptor.padded_rows();
  for (Index i = 0; i < kept.count; ++i) {
    const Index at = kept.original[i];
    kept.x[i] = cloud.x[at];
    kept.y[i] = cloud.y[at];
    kept.z[i] = cloud.z[at];
    std::copy_n(f.descriptors.data() + at * rows, rows, kept.descriptors.data() + i * rows);
  }
}

/// Matches of all source points: argmax of the similarities, ties by lower position, and the row
/// maxima of the pair features.
void match_points(const ModelData& model, Workspace& w) noexcept {
  FineBuffers& fine = w.fine;
  const KeptPoints& source = fine.kept[0];
  const KeptPoints& target = fine.kept[1];
  const Coordinates targets = coordinates_of(target.x, target.y, target.z);
  const Index rows = model.pair.rows;
  parallel_for(w.threads, source.count, [&](Index i, int thread) {
    float* similarity =
        fine.similarity.data() + (w.recorder.enabled() ? i : Index{thread}) * target.count;
    const float position[3] = {fine.moved_x[i], fine.moved_y[i], fine.moved_z[i]};
    kernels::pair_row(model.pair, source.parts.data() + i * rows, target.parts.data(), position,
                      targets, target.count, w.scratch[static_cast<std::size_t>(thread)].pairs,
                      similarity, fine.row_maxima.data() + i * rows);
    const float* best = std::max_element(similarity, similarity + target.count);
    fine.match[i] = static_cast<std::uint32_t>(best - similarity);
  });
}

/// sigmoid(MLP(row maximum)), zero below the lower median, divided by (sum + 1e-8).
void weigh_matches(const ModelData& model, FineBuffers& fine) noexcept {
  const Index count = fine.kept[0].count;
  const Index hidden_rows = model.weight[0].padded_rows();
  const Index out_rows = model.weight[1].padded_rows();
  kernels::linear(model.weight[0], fine.row_maxima.data(), model.pair.rows, count,
                  fine.weight_hidden.data());
  kernels::relu(fine.weight_hidden.data(), hidden_rows * count);
  kernels::linear(model.weight[1], fine.weight_hidden.data(), hidden_rows, count,
                  fine.weight_rows.data());
  float* weights = fine.weights.data();
  for (Index i = 0; i < count; ++i) {
    const float weight = kernels::sigmoid(fine.weight_rows[i * out_rows]);
    weights[i] =
        weight >= 0.0f ? weight : 0.0f;  // NaN, where the network overflows, weighs nothing
  }
  float* sorted = fine.sorted_weights.data();
  std::copy_n(weights, count, sorted);
  std::nth_element(sorted, sorted + (count - 1) / 2, sorted + count);
  const float median = sorted[(count - 1) / 2];
  float sum = 0.0f;
  for (Index i = 0; i < count; ++i) {
    if (weights[i] < median) weights[i] = 0.0f;
    sum += weights[i];
  }
  for (Index i = 0; i < count; ++i) weights[i] /= sum + 1e-8f;
}

/// The weighted Procrustes step from the moved source points to their matches.
RigidTransform fine_step(FineBuffers& fine) noexcept {
  const KeptPoints& target = fine.kept[1];
  const Index count = fine.kept[0].count;
  for (Index i = 0; i < count; ++i) {
    const Index j = fine.match[i];
    fine.matched_x[i] = target.x[j];
    fine.matched_y[i] = target.y[j];
    fine.matched_z[i] = target.z[j];
  }
  return kernels::procrustes(coordinates_of(fine.moved_x, fine.moved_y, fine.moved_z),
                             coordinates_of(fine.matched_x, fine.matched_y, fine.matched_z),
                             fine.weights.data(), count)
      .transform;
}

void record_kept(Workspace& w) noexcept {
  for (Index side = 0; side < 2; ++side) {
    const KeptPoints& kept = w.fine.kept[side];
    w.recorder.list(side_name(side), "kept", kept.original.data(), kept.count);
  }
}

void record_step(Index iteration, const RigidTransform& pose, Workspace& w) noexcept {
  if (!w.recorder.enabled()) return;
  const Index sources = w.fine.kept[0].count;
  const Index targets = w.fine.kept[1].count;
  const std::string text = "fine." + std::to_string(iteration) + ".";  // short: never allocates
  const char* prefix = text.c_str();
  w.recorder.matrix(prefix, "similarity", w.fine.similarity.data(), targets, targets, sources);
  w.recorder.list(prefix, "match", w.fine.match.data(), sources);
  w.recorder.list(prefix, "weight", w.fine.weights.data(), sources);
  w.recorder.pose(prefix, "T", pose);
}

}  // namespace

RigidTransform register_fine(const ModelData& model, const RigidTransform& coarse,
                             Workspace& w) noexcept {
  FineBuffers& fine = w.fine;
  for (Index side = 0; side < 2; ++side) {
    KeptPoints& kept = fine.kept[side];
    eliminate(model, w.cloud[side], w.features[side], kept);
    kernels::linear(side == 0 ? model.pair.source : model.pair.target, kept.descriptors.data(),
                    model.descriptor.padded_rows(), kept.count, kept.parts.data());
  }
  record_kept(w);
  const KeptPoints& source = fine.kept[0];
  const Coordinates source_points = coordinates_of(source.x, source.y, source.z);
  RigidTransform pose = coarse;
  for (Index iteration = 0; iteration < model.arch.fine_iterations; ++iteration) {
    move_points(pose, source_points, source.count, fine.moved_x.data(), fine.moved_y.data(),
                fine.moved_z.data());
    match_points(model, w);
    weigh_matches(model, fine);
    pose = kernels::compose(fine_step(fine), pose);
    record_step(iteration, pose, w);
  }
  w.reached.matched = !w.deadline.expired();
  return pose;
}

}  // namespace vnreg::detail
