#include "engine/hypotheses.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/counter_hash.hpp"
#include "engine/pair_table.hpp"
#include "engine/verify.hpp"

namespace vnreg::detail {
namespace {

using Pair = PairTable::Pair;
using Eigen::Matrix3f;
using Eigen::Vector3f;

// The part of the first normal across the pair's line fixes the turn about the line: a source pair
// with less of it is not drawn, a target pair with less is no counterpart.
constexpr float least_across_source = 0.3f;
constexpr float least_across_target = 0.2f;
// Between the first normals' parts along the line: room for a bin and noise, not for a wrong sign.
constexpr float most_along_difference = 0.3f;
// Cosine between the second normals, when the pose is fixed by the first.
constexpr float least_second_agreement = 0.9f;
// Of at most probe_points.
constexpr float least_probe = 8.0f;
// Pairs in a plane are alike: of a larger group, so many are tried, evenly.
constexpr std::uint32_t most_counterparts = 128;

Vector3f point_of(const Surface& s, std::size_t i) noexcept { return {s.x[i], s.y[i], s.z[i]}; }

Vector3f normal_of(const Surface& s, std::size_t i) noexcept {
  return {s.normal_x[i], s.normal_y[i], s.normal_z[i]};
}

/// The frame of a line of direction u: u, the part of the normal across it, and their cross
/// product.
Matrix3f frame_of(const Vector3f& u, const Vector3f& across) noexcept {
  Matrix3f frame;
  frame.col(0) = u;
  frame.col(1) = across.normalized();
  frame.col(2) = u.cross(frame.col(1));
  return frame;
}

struct SourcePair {
  Vector3f middle, second_normal;
  Matrix3f frame;
  float along;  // first normal, along the line
};

/// False if the pair does not fix a turn about its line.
bool make_source_pair(const Surface& s, Pair pair, SourcePair& out) noexcept {
  const Vector3f a = point_of(s, pair.first), b = point_of(s, pair.second);
  const Vector3f u = (b - a).normalized();
  const Vector3f normal = normal_of(s, pair.first);
  out.along = normal.dot(u);
  const Vector3f across = normal - out.along * u;
  if (across.norm() < least_across_source) return false;
  out.middle = (a + b) / 2;
  out.second_normal = normal_of(s, pair.second);
  out.frame = frame_of(u, across);
  return true;
}

/// The motion of a source pair onto a target pair whose first normal is taken with `sign`. False
/// if they do not fit after all.
bool motion_between(const SourcePair& source, const Surface& target, Pair pair, float sign,
                    Motion& motion) noexcept {
  const Vector3f a = point_of(target, pair.first), b = point_of(target, pair.second);
  const Vector3f u = (b - a).normalized();
  const Vector3f normal = sign * normal_of(target, pair.first);
  const float along = normal.dot(u);
  if (std::abs(along - source.along) > most_along_difference) return false;
  const Vector3f across = normal - along * u;
  if (across.norm() < least_across_target) return false;
  const Matrix3f rotation = frame_of(u, across) * source.frame.transpose();
  const float agreement = (rotation * source.second_normal).dot(normal_of(target, pair.second));
  if (std::abs(agreement) < least_second_agreement) return false;
  const Vector3f translation = (a + b) / 2 - rotation * source.middle;
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(motion.rotation) = rotation;
  Eigen::Map<Vector3f>(motion.translation) = translation;
  return true;
}

/// The best hypotheses of a chunk: a heap of fixed size with the worst of them in front.
class BestHypotheses {
 public:
  explicit BestHypotheses(Hypothesis* storage) noexcept : storage_(storage) {}

  Index count() const noexcept { return count_; }

  void offer(const Hypothesis& h) noexcept {
    const auto order = [](const Hypothesis& a, const Hypothesis& b) { return better(a, b); };
    if (count_ < kept_per_chunk) {
      storage_[count_++] = h;
      std::push_heap(storage_, storage_ + count_, order);
    } else if (better(h, storage_[0])) {
      std::pop_heap(storage_, storage_ + count_, order);
      storage_[count_ - 1] = h;
      std::push_heap(storage_, storage_ + count_, order);
    }
  }

 private:
  Hypothesis* storage_;
  Index count_ = 0;
};

/// Two different points of the source, by the draw's number.
Pair draw(std::uint64_t seed, Index number, Index count) noexcept {
  const std::uint64_t random = counter_hash(seed, static_cast<std::uint64_t>(number));
  const auto n = static_cast<std::uint64_t>(count);
  const std::uint64_t first = (random & 0xffffffffu) % n;
  const std::uint64_t second = (first + 1 + (random >> 32) % (n - 1)) % n;
  return {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(second)};
}

/// Tries all counterparts of one source pair.
void try_counterparts(const Workspace& w, Pair pair, std::uint32_t& ordinal,
                      BestHypotheses& best) noexcept {
  const VerifiedWorkspace& v = w.verified;
  const std::uint16_t key = pair_key(v.surface[0], pair.first, pair.second);
  SourcePair source;
  if (key == no_pair_key || !make_source_pair(v.surface[0], pair, source)) return;
  const std::uint32_t start = v.table.start[key];
  const std::uint32_t count = v.table.start[key + 1u] - start;
  const std::uint32_t tried = std::min(count, most_counterparts);
  for (std::uint32_t i = 0; i < tried; ++i) {
    const Pair counterpart = v.table.pairs[start + std::uint64_t{i} * count / tried];
    for (const float sign : {-1.0f, 1.0f}) {
      Hypothesis h;
      if (!motion_between(source, v.surface[1], counterpart, sign, h.motion)) continue;
      h.score = probe(h.motion, v.surface, probe_tolerance * v.spacing);
      h.ordinal = ordinal++;
      if (h.score >= least_probe) best.offer(h);
    }
  }
}

}  // namespace

void propose_poses(std::uint64_t seed, Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  fill_pair_table(w);
  parallel_for(w.threads, draw_chunks, [&](Index chunk, int) {
    // Two hypotheses per counterpart at most: the ordinals of two chunks do not overlap.
    auto ordinal = static_cast<std::uint32_t>(chunk * draws_per_chunk * 2 * most_counterparts);
    BestHypotheses best(v.hypotheses.data() + chunk * kept_per_chunk);
    for (Index i = 0; i < draws_per_chunk; ++i) {
      const Pair pair = draw(seed, chunk * draws_per_chunk + i, v.surface[0].count);
      try_counterparts(w, pair, ordinal, best);
    }
    v.kept[static_cast<std::size_t>(chunk)] = best.count();
  });
}

}  // namespace vnreg::detail
