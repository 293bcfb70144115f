#include "engine/match_hypotheses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "engine/descriptors.hpp"
#include "kernels/fit_rotations.hpp"
#include "kernels/linear.hpp"

namespace vnreg::detail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::internal::padd;
using Eigen::internal::pcmp_lt;
using Eigen::internal::ploadu;
using Eigen::internal::plset;
using Eigen::internal::pmax;
using Eigen::internal::pmin;
using Eigen::internal::pmul;
using Eigen::internal::pselect;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;
using kernels::Packet;

// Two matches agree when their distances in both clouds differ by less than this, and say something
// when they are farther apart than the other; in r.m.s. radii.
constexpr float agreement_distance = 0.15f;
constexpr float least_apart = 0.13f;

// Rows and columns of a task of the matches' compatibility.
constexpr Index support_block = 64;

using RowMajorMap = Eigen::Map<kernels::RowMajorMatrix>;

RowMajorMap rows_of(kernels::Floats& values, Index rows, Index columns) noexcept {
  return {values.data(), rows, columns};
}

Eigen::Map<const kernels::RowMajorMatrix> rows_of(const kernels::Floats& values, Index rows,
                                                  Index columns) noexcept {
  return {values.data(), rows, columns};
}

Index blocks_of(Index count) noexcept { return (count + product_block - 1) / product_block; }

/// Block `number` of the similarity's rows: <local, local'> + <context, context'>.
void multiply_descriptors(const CloudDescriptors& source, const CloudDescriptors& target,
                          Index number, MatchBuffers& b) noexcept {
  const Index rows = source.count, columns = target.count, r = number * product_block;
  const Index height = std::min(product_block, rows - r);
  RowMajorMap similarity = rows_of(b.similarity, rows, columns);
  const auto local = rows_of(target.local, columns, target.local_stride);
  const auto context = rows_of(target.context, columns, target.context_stride);
  // In blocks that Eigen's product packs on the stack, not on the heap.
  for (Index c = 0; c < columns; c += product_block) {
    const Index width = std::min(product_block, columns - c);
    auto block = similarity.block(r, c, height, width);
    block.noalias() = rows_of(source.local, rows, source.local_stride).middleRows(r, height) *
                      local.middleRows(c, width).transpose();
    block.noalias() += rows_of(source.context, rows, source.context_stride).middleRows(r, height) *
                       context.middleRows(c, width).transpose();
  }
  b.block_largest[static_cast<std::size_t>(number)] = similarity.middleRows(r, height).maxCoeff();
}

/// The same block: exp(similarity - largest), its sums by row, and its share of the column sums.
void exponentiate(Index rows, Index columns, Index number, MatchBuffers& b) noexcept {
  RowMajorMap similarity = rows_of(b.similarity, rows, columns);
  float* sums = b.block_sum.data() + number * columns;
  std::fill_n(sums, columns, 0.0f);
  Eigen::Map<Eigen::RowVectorXf> column_sum(sums, columns);
  const Index first = number * product_block;
  for (Index r = first; r < std::min(first + product_block, rows); ++r) {
    similarity.row(r) = (similarity.row(r).array() - b.largest).exp();
    b.row_sum[static_cast<std::size_t>(r)] = similarity.row(r).sum();
    column_sum += similarity.row(r);
  }
}

/// similarity = exp(<local, local'> + <context, context'> - largest), and its sums.
void compare_descriptors(const CloudDescriptors& source, const CloudDescriptors& target,
                         const Threads& threads, MatchBuffers& b) noexcept {
  const Index rows = source.count, columns = target.count, blocks = blocks_of(rows);
  parallel_for(threads, blocks, [&](Index i, int) { multiply_descriptors(source, target, i, b); });
  b.largest = *std::max_element(b.block_largest.begin(), b.block_largest.begin() + blocks);
  parallel_for(threads, blocks, [&](Index i, int) { exponentiate(rows, columns, i, b); });
  Eigen::Map<Eigen::RowVectorXf>(b.column_sum.data(), columns) =
      rows_of(b.block_sum, blocks, columns).colwise().sum();
}

/// The two best columns of each lane.
struct BestOfLanes {
  Packet first = pset1<Packet>(0.0f), second = first;           // their weights
  Packet first_at = pset1<Packet>(0.0f), second_at = first_at;  // columns, exact in float32

  void offer(const Packet& weight, const Packet& at) noexcept {
    const Packet best = pcmp_lt(first, weight);
    const Packet rest = pmin(first, weight), rest_at = pselect(best, first_at, at);
    first = pmax(first, weight);
    first_at = pselect(best, at, first_at);
    second_at = pselect(pcmp_lt(second, rest), rest_at, second_at);
    second = pmax(second, rest);
  }
};

/// The two columns with the largest squares times weights, the first of equal ones first.
std::array<Match, 2> best_two(const float* row, const float* column_weight,
                              Index columns) noexcept {
  constexpr Index lanes = kernels::packet_size;
  std::array<Match, 2> best;
  const auto offer = [&](float weight, Index at) {
    const Match match{weight, 0, static_cast<std::uint16_t>(at)};
    const auto before = [](const Match& x, const Match& y) {
      return x.weight != y.weight ? x.weight > y.weight : x.target < y.target;
    };
    if (!before(match, best[1])) return;
    best[1] = match;
    if (before(best[1], best[0])) std::swap(best[0], best[1]);
  };
  BestOfLanes of_lanes;
  Packet at = plset<Packet>(0.0f);
  Index c = 0;
  for (; c + lanes <= columns; c += lanes) {
    const Packet value = ploadu<Packet>(row + c);
    of_lanes.offer(pmul(pmul(value, value), ploadu<Packet>(column_weight + c)), at);
    at = padd(at, pset1<Packet>(static_cast<float>(lanes)));
  }
  float weights[2][lanes], places[2][lanes];
  pstoreu(weights[0], of_lanes.first);
  pstoreu(weights[1], of_lanes.second);
  pstoreu(places[0], of_lanes.first_at);
  pstoreu(places[1], of_lanes.second_at);
  for (int k = 0; k < 2; ++k) {
    for (Index i = 0; i < lanes; ++i) offer(weights[k][i], static_cast<Index>(places[k][i]));
  }
  for (; c < columns; ++c) offer(row[c] * row[c] * column_weight[c], c);
  return best;
}

/// The two best partners of every source point, by dual softmax and significance; of all these, the
/// best most_matches, the best first.
void select_matches(const CloudDescriptors& source, const CloudDescriptors& target,
                    const Threads& threads, MatchBuffers& b) noexcept {
  constexpr float smallest = 1e-30f;
  const Index rows = source.count, columns = target.count;
  for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c) {
    b.column_weight[c] =
        kernels::sigmoid(target.significance[c]) / std::max(b.column_sum[c], smallest);
  }
  b.matches.clear();
  b.matches.resize(2 * static_cast<std::size_t>(rows));
  parallel_for(threads, blocks_of(rows), [&](Index block, int) {
    const Index first = block * product_block;
    for (Index i = first; i < std::min(first + product_block, rows); ++i) {
      const auto r = static_cast<std::size_t>(i);
      const float row_weight =
          kernels::sigmoid(source.significance[r]) / std::max(b.row_sum[r], smallest);
      const auto best =
          best_two(b.similarity.data() + i * columns, b.column_weight.data(), columns);
      for (std::size_t k = 0; k < 2; ++k) {
        b.matches[2 * r + k] = {best[k].weight * row_weight, static_cast<std::uint16_t>(i),
                                best[k].target};
      }
    }
  });
  std::erase_if(b.matches, [](const Match& match) { return !(match.weight > 0); });
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

/// Turns pairs of places with matrices sum y x^T into motions, all at once.
class MotionBatch {
 public:
  /// The motion that lays `from` on `to` and turns as h says. Left out if h determines no rotation.
  void add(const Matrix3d& h, const Vector3d& from, const Vector3d& to) noexcept {
    if (!h.allFinite()) return;
    for (int k = 0; k < 9; ++k) h_.entry[k][count_] = h(k / 3, k % 3);
    from_[count_] = from;
    to_[count_] = to;
    ++count_;
  }

  /// Writes the motions, lengths times `scale`, and returns their number.
  Index write(double scale, Motion* motions) const noexcept {
    kernels::MatrixBatch rotation;
    bool determined[kernels::MatrixBatch::capacity];
    kernels::fit_rotations(h_, count_, rotation, determined);
    Index written = 0;
    for (Index i = 0; i < count_; ++i) {
      if (!determined[i]) continue;
      kernels::RigidTransform pose;
      for (int k = 0; k < 9; ++k) pose.rotation(k / 3, k % 3) = rotation.entry[k][i];
      pose.translation = scale * (to_[i] - pose.rotation * from_[i]);
      motions[written++] = to_motion(pose);
    }
    return written;
  }

 private:
  Index count_ = 0;
  kernels::MatrixBatch h_;
  Vector3d from_[kernels::MatrixBatch::capacity], to_[kernels::MatrixBatch::capacity];
};

/// The motion that lays the frames of the source point on those of the target point, about the
/// points.
void add_match(const CloudDescriptors& source, const CloudDescriptors& target,
               const kernels::Floats& source_frames, const kernels::Floats& target_frames,
               const Match& match, MotionBatch& batch) noexcept {
  using Frames = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>;
  const Index frames = source.frames;
  const Frames a(source_frames.data() + 3 * frames * match.source, frames, 3);
  const Frames b(target_frames.data() + 3 * frames * match.target, frames, 3);
  // Lazy: a product of this size needs no blocking, and so no memory.
  batch.add(b.transpose().lazyProduct(a).cast<double>(), place(source, match.source).cast<double>(),
            place(target, match.target).cast<double>());
}

/// apart[j] = how far the places of matches i and j lie from each other.
void measure_distances(const kernels::Floats place[3], std::size_t i, Index count,
                       float* apart) noexcept {
  const auto along = [&](std::size_t axis) {
    return Eigen::Map<const Eigen::ArrayXf>(place[axis].data(), count) - place[axis][i];
  };
  Eigen::Map<Eigen::ArrayXf>(apart, count) =
      (along(0).square() + along(1).square() + along(2).square()).sqrt();
}

/// Rows of compatibility(i, j): 1 where matches i and j keep their distance, 0 where they do not.
void measure_compatibility(Index first, Index last, MatchBuffers& b) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  alignas(64) float one[most_matches], other[most_matches];
  for (Index i = first; i < last; ++i) {
    measure_distances(b.place[0], static_cast<std::size_t>(i), count, one);
    measure_distances(b.place[1], static_cast<std::size_t>(i), count, other);
    float* row = b.compatibility.data() + i * count;
#pragma omp simd
    for (Index j = 0; j < count; ++j) {
      const float off = (one[j] - other[j]) * (1 / agreement_distance);
      const float inside = 1 - off * off;
      const float nearest = one[j] < other[j] ? one[j] : other[j];
      const float telling = nearest > least_apart ? 1.0f : 0.0f;
      row[j] = telling * (inside > 0 ? inside : 0);
    }
  }
}

/// A block of support = compatibility^2, and the one across the diagonal, which is its mirror.
void multiply_compatibility(Index r, Index c, MatchBuffers& b) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  const RowMajorMap compatibility = rows_of(b.compatibility, count, count);
  RowMajorMap support = rows_of(b.support, count, count);
  const Index height = std::min(support_block, count - r);
  const Index width = std::min(support_block, count - c);
  auto block = support.block(r, c, height, width);
  block.setZero();
  for (Index k = 0; k < count; k += product_block) {
    const Index depth = std::min(product_block, count - k);
    block.noalias() +=
        compatibility.block(r, k, height, depth) * compatibility.block(k, c, depth, width);
  }
  block.array() *= compatibility.block(r, c, height, width).array();
  if (c > r) support.block(c, r, width, height) = block.transpose();
}

/// support(i, j): how many matches agree with both, if i and j agree (second-order spatial
/// compatibility, Chen et al., CVPR 2022).
void measure_agreement(const Threads& threads, MatchBuffers& b) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  const Index blocks = (count + support_block - 1) / support_block;
  parallel_for(threads, blocks, [&](Index i, int) {
    measure_compatibility(i * support_block, std::min((i + 1) * support_block, count), b);
  });
  // The blocks on the diagonal and above it.
  parallel_for(threads, blocks * (blocks + 1) / 2, [&](Index i, int) {
    Index row = 0, behind = i;
    for (; behind >= blocks - row; ++row) behind -= blocks - row;
    multiply_compatibility(row * support_block, (row + behind) * support_block, b);
  });
}

/// The matches that support one most, the most first, equal ones by index.
struct Group {
  static constexpr Index capacity = group_size - 1;
  Index count = 0;
  std::uint16_t match[capacity];

  Group(const float* support, Index matches) noexcept {
    float most[capacity];
    for (Index i = 0; i < matches; ++i) {
      if (!(support[i] > (count == capacity ? most[capacity - 1] : 0.0f))) continue;
      Index at = count < capacity ? count++ : capacity - 1;
      for (; at > 0 && most[at - 1] < support[i]; --at) {
        most[at] = most[at - 1];
        match[at] = match[at - 1];
      }
      most[at] = support[i];
      match[at] = static_cast<std::uint16_t>(i);
    }
  }
};

/// The motion of a match and those that support it most.
void add_group(std::uint16_t seed, const MatchBuffers& b, MotionBatch& batch) noexcept {
  const auto count = static_cast<Index>(b.matches.size());
  const Group group(b.support.data() + seed * count, count);
  if (group.count < 2) return;
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, group_size> places[2];
  for (std::size_t side = 0; side < 2; ++side) {
    places[side].resize(3, group.count + 1);
    for (Index i = 0; i <= group.count; ++i) {
      const std::size_t match = i == 0 ? seed : group.match[i - 1];
      for (Index axis = 0; axis < 3; ++axis) {
        places[side](axis, i) = static_cast<double>(b.place[side][axis][match]);
      }
    }
  }
  const Vector3d from = places[0].rowwise().mean(), to = places[1].rowwise().mean();
  batch.add((places[1].colwise() - to).lazyProduct((places[0].colwise() - from).transpose()), from,
            to);
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

constexpr Index matches_per_task = kernels::MatrixBatch::capacity / 2;  // two motions each
constexpr Index seeds_per_task = most_seeds / 2;
constexpr Index most_tasks = most_matches / matches_per_task + most_seeds / seeds_per_task;
static_assert(most_seeds % seeds_per_task == 0 && seeds_per_task <= kernels::MatrixBatch::capacity);

/// The motions of all matches and groups, one behind the other. Returns their number.
Index write_motions(Index seeds, Workspace& w) noexcept {
  MatchBuffers& b = w.verified.match;
  const CloudDescriptors& source = w.descriptors.features[0].out;
  const CloudDescriptors& target = w.descriptors.features[1].out;
  const auto matches = static_cast<Index>(b.matches.size());
  const Index match_tasks = (matches + matches_per_task - 1) / matches_per_task;
  const Index group_tasks = (seeds + seeds_per_task - 1) / seeds_per_task;
  const auto place_of = [&](Index task) {
    return 2 * matches_per_task * std::min(task, match_tasks) +
           seeds_per_task * std::max<Index>(task - match_tasks, 0);
  };
  std::array<Index, static_cast<std::size_t>(most_tasks)> written{};
  parallel_for(w.threads, match_tasks + group_tasks, [&](Index task, int) {
    MotionBatch batch;
    if (task < match_tasks) {
      const Index first = task * matches_per_task;
      for (Index i = first; i < std::min(first + matches_per_task, matches); ++i) {
        const Match& match = b.matches[static_cast<std::size_t>(i)];
        add_match(source, target, source.context_frames, target.context_frames, match, batch);
        add_match(source, target, source.local_frames, target.local_frames, match, batch);
      }
    } else {
      const Index first = (task - match_tasks) * seeds_per_task;
      for (Index i = first; i < std::min(first + seeds_per_task, seeds); ++i) {
        add_group(b.seeds[static_cast<std::size_t>(i)], b, batch);
      }
    }
    written[static_cast<std::size_t>(task)] =
        batch.write(1 / w.verified.radius, b.motions.data() + place_of(task));
  });
  Index count = 0;
  for (Index task = 0; task < match_tasks + group_tasks; ++task) {
    const Index some = written[static_cast<std::size_t>(task)];
    std::copy_n(b.motions.data() + place_of(task), some, b.motions.data() + count);
    count += some;
  }
  return count;
}

}  // namespace

Index propose_from_matches(Workspace& w) noexcept {
  MatchBuffers& b = w.verified.match;
  const CloudDescriptors& source = w.descriptors.features[0].out;
  const CloudDescriptors& target = w.descriptors.features[1].out;
  compare_descriptors(source, target, w.threads, b);
  if (w.deadline.passed()) return 0;
  select_matches(source, target, w.threads, b);
  gather_places(source, target, b);
  if (w.deadline.passed()) return 0;
  w.reached.matched = true;
  measure_agreement(w.threads, b);
  if (w.deadline.passed()) return 0;
  return write_motions(select_seeds(b), w);
}

}  // namespace vnreg::detail
