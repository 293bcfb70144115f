#include "engine/match_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/descriptors.hpp"
#include "kernels/linear.hpp"

namespace vnreg::detail {
namespace {

using Eigen::Vector3f;
using kernels::Coordinates;

// Two matches agree when their distances in both clouds differ by less than this, and say something
// when they are farther apart than the other; in r.m.s. radii.
constexpr float agreement_distance = 0.15f;
constexpr float least_apart = 0.13f;
// Second singular value of what fixes a rotation, relative to the first.
constexpr double least_determined = 1e-6;

using RowMajorMap = Eigen::Map<kernels::RowMajorMatrix>;

RowMajorMap rows_of(kernels::Floats& values, Index rows, Index columns) noexcept {
  return {values.data(), rows, columns};
}

Eigen::Map<const kernels::RowMajorMatrix> rows_of(const kernels::Floats& values, Index rows,
                                                  Index columns) noexcept {
  return {values.data(), rows, columns};
}

/// similarity = exp(<local, local'> + <context, context'> - largest), and its sums.
void compare_descriptors(const CloudDescriptors& source, const CloudDescriptors& target,
                         MatchBuffers& b) noexcept {
  const Index rows = source.count, columns = target.count;
  RowMajorMap similarity = rows_of(b.similarity, rows, columns);
  const auto local = rows_of(target.local, columns, target.local_stride);
  const auto context = rows_of(target.context, columns, target.context_stride);
  // In blocks that Eigen's product packs on the stack, not on the heap.
  for (Index r = 0; r < rows; r += product_block) {
    const Index height = std::min(product_block, rows - r);
    for (Index c = 0; c < columns; c += product_block) {
      const Index width = std::min(product_block, columns - c);
      auto block = similarity.block(r, c, height, width);
      block.noalias() = rows_of(source.local, rows, source.local_stride).middleRows(r, height) *
                        local.middleRows(c, width).transpose();
      block.noalias() +=
          rows_of(source.context, rows, source.context_stride).middleRows(r, height) *
          context.middleRows(c, width).transpose();
    }
  }
  b.largest = similarity.maxCoeff();
  std::fill_n(b.column_sum.data(), columns, 0.0f);
  Eigen::Map<Eigen::RowVectorXf> column_sum(b.column_sum.data(), columns);
  for (Index r = 0; r < rows; ++r) {
    similarity.row(r) = (similarity.row(r).array() - b.largest).exp();
    b.row_sum[static_cast<std::size_t>(r)] = similarity.row(r).sum();
    column_sum += similarity.row(r);
  }
}

/// The two best partners of every source point, by dual softmax and significance; of all these, the
/// best most_matches, the best first.
void select_matches(const CloudDescriptors& source, const CloudDescriptors& target,
                    MatchBuffers& b) noexcept {
  constexpr float smallest = 1e-30f;
  const Index columns = target.count;
  for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c) {
    b.column_weight[c] =
        kernels::sigmoid(target.significance[c]) / std::max(b.column_sum[c], smallest);
  }
  b.matches.clear();
  for (std::size_t r = 0; r < static_cast<std::size_t>(source.count); ++r) {
    const float* row = b.similarity.data() + static_cast<Index>(r) * columns;
    const float row_weight =
        kernels::sigmoid(source.significance[r]) / std::max(b.row_sum[r], smallest);
    Match best[2];
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c) {
      const float weight = row[c] * row[c] * row_weight * b.column_weight[c];
      if (!(weight > best[1].weight)) continue;
      best[1] = {weight, static_cast<std::uint16_t>(r), static_cast<std::uint16_t>(c)};
      if (best[1].weight > best[0].weight) std::swap(best[0], best[1]);
    }
    for (const Match& match : best) {
      if (match.weight > 0) b.matches.push_back(match);
    }
  }
  const std::size_t kept = std::min(b.matches.size(), static_cast<std::size_t>(most_matches));
  std::partial_sort(b.matches.begin(), b.matches.begin() + static_cast<Index>(kept),
                    b.matches.end(), [](const Match& x, const Match& y) {
                      if (x.weight != y.weight) return x.weight > y.weight;
                      return std::pair(x.source, x.target) < std::pair(y.source, y.target);
                    });
  b.matches.resize(kept);
}

Vector3f place(const CloudDescriptors& d, std::size_t i) noexcept {
  return {d.x[i], d.y[i], d.z[i]};
}

/// The rotation that lays the frames of the source point on those of the target point, about the
/// points. False if the frames determine none.
bool pose_of_match(const CloudDescriptors& source, const CloudDescriptors& target,
                   const kernels::Floats& source_frames, const kernels::Floats& target_frames,
                   const Match& match, kernels::RigidTransform& pose) noexcept {
  using Frames = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>;
  const Index frames = source.frames;
  const Frames a(source_frames.data() + 3 * frames * match.source, frames, 3);
  const Frames b(target_frames.data() + 3 * frames * match.target, frames, 3);
  // Lazy: a product of this size needs no blocking, and so no memory.
  const Eigen::Matrix3d h = b.transpose().lazyProduct(a).cast<double>();
  if (!h.allFinite()) return false;
  const kernels::RotationFit fit = kernels::fit_rotation(h);
  if (!(fit.singular_values(1) > least_determined * fit.singular_values(0))) return false;
  pose.rotation = fit.rotation;
  pose.translation = place(target, match.target).cast<double>() -
                     pose.rotation * place(source, match.source).cast<double>();
  return true;
}

/// compatibility(i, j): 1 where matches i and j keep their distance, 0 where they do not; `support`
/// also counts the matches that agree with both (second-order spatial compatibility, Chen et al.,
/// CVPR 2022).
void measure_agreement(MatchBuffers& b) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    float* row = b.compatibility.data() + static_cast<Index>(i) * count;
#pragma omp simd
    for (Index j = 0; j < count; ++j) {
      const auto apart = [&](const kernels::Floats* p) {
        const float dx = p[0][i] - p[0][static_cast<std::size_t>(j)];
        const float dy = p[1][i] - p[1][static_cast<std::size_t>(j)];
        const float dz = p[2][i] - p[2][static_cast<std::size_t>(j)];
        return std::sqrt(dx * dx + dy * dy + dz * dz);
      };
      const float first = apart(b.place[0]), second = apart(b.place[1]);
      const float off = (first - second) * (1 / agreement_distance);
      const float inside = 1 - off * off;
      row[j] = inside > 0 && first > least_apart && second > least_apart ? inside : 0;
    }
  }
  RowMajorMap compatibility = rows_of(b.compatibility, count, count);
  RowMajorMap support = rows_of(b.support, count, count);
  for (Index r = 0; r < count; r += product_block) {
    for (Index c = 0; c < count; c += product_block) {
      const Index height = std::min(product_block, count - r);
      const Index width = std::min(product_block, count - c);
      auto block = support.block(r, c, height, width);
      block.setZero();
      for (Index k = 0; k < count; k += product_block) {
        const Index depth = std::min(product_block, count - k);
        block.noalias() +=
            compatibility.block(r, k, height, depth) * compatibility.block(k, c, depth, width);
      }
    }
  }
  support.array() *= compatibility.array();
}

/// The pose of a match and those that support it most.
bool pose_of_group(Index seed, MatchBuffers& b, kernels::RigidTransform& pose) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  const float* support = b.support.data() + seed * count;
  const Index members = std::min(group_size - 1, count);
  std::iota(b.order.begin(), b.order.begin() + count, std::uint16_t{0});
  const auto more = [&](std::uint16_t x, std::uint16_t y) {
    return support[x] != support[y] ? support[x] > support[y] : x < y;
  };
  std::partial_sort(b.order.begin(), b.order.begin() + members, b.order.begin() + count, more);
  float places[2][3][group_size];
  Index size = 0;
  const auto add = [&](std::size_t match) {
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        places[side][axis][size] = b.place[side][axis][match];
      }
    }
    ++size;
  };
  add(static_cast<std::size_t>(seed));
  for (Index i = 0; i < members && support[b.order[static_cast<std::size_t>(i)]] > 0; ++i) {
    add(b.order[static_cast<std::size_t>(i)]);
  }
  if (size < 3) return false;
  const auto solution =
      kernels::procrustes(Coordinates{places[0][0], places[0][1], places[0][2]},
                          Coordinates{places[1][0], places[1][1], places[1][2]}, nullptr, size);
  pose = solution.transform;
  return solution.singular_values(1) > least_determined * solution.singular_values(0);
}

/// The matches with the most support by others, the most first.
Index select_seeds(MatchBuffers& b) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  const RowMajorMap support = rows_of(b.support, count, count);
  for (Index i = 0; i < count; ++i) {
    b.total_support[static_cast<std::size_t>(i)] = support.row(i).sum();
  }
  const Index seeds = std::min(most_seeds, count);
  std::iota(b.seeds.begin(), b.seeds.begin() + count, std::uint16_t{0});
  std::partial_sort(b.seeds.begin(), b.seeds.begin() + seeds, b.seeds.begin() + count,
                    [&](std::uint16_t x, std::uint16_t y) {
                      const float a = b.total_support[x], c = b.total_support[y];
                      return a != c ? a > c : x < y;
                    });
  return seeds;
}

void gather_places(const CloudDescriptors& source, const CloudDescriptors& target,
                   MatchBuffers& b) noexcept {
  for (std::size_t i = 0; i < b.matches.size(); ++i) {
    const Vector3f from = place(source, b.matches[i].source),
                   to = place(target, b.matches[i].target);
    for (Index axis = 0; axis < 3; ++axis) {
      b.place[0][axis][i] = from(axis);
      b.place[1][axis][i] = to(axis);
    }
  }
}

}  // namespace

Index propose_from_matches(Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  MatchBuffers& b = v.match;
  const CloudDescriptors& source = w.descriptors.features[0].out;
  const CloudDescriptors& target = w.descriptors.features[1].out;
  compare_descriptors(source, target, b);
  if (w.deadline.passed()) return 0;
  select_matches(source, target, b);
  gather_places(source, target, b);
  if (w.deadline.passed()) return 0;
  Index count = 0;
  const auto add = [&](kernels::RigidTransform pose) {
    pose.translation /= v.radius;
    b.motions[static_cast<std::size_t>(count++)] = to_motion(pose);
  };
  kernels::RigidTransform pose;
  for (const Match& match : b.matches) {
    if (pose_of_match(source, target, source.context_frames, target.context_frames, match, pose)) {
      add(pose);
    }
    if (pose_of_match(source, target, source.local_frames, target.local_frames, match, pose)) {
      add(pose);
    }
  }
  if (w.deadline.passed()) return 0;
  measure_agreement(b);
  const Index seeds = select_seeds(b);
  for (Index i = 0; i < seeds && !w.deadline.passed(); ++i) {
    if (pose_of_group(b.seeds[static_cast<std::size_t>(i)], b, pose)) add(pose);
  }
  return count;
}

}  // namespace vnreg::detail
