#include "engine/judge_inputs.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace vnreg::detail {
namespace {

using kernels::Surroundings;
using kernels::surroundings_radii;

// In units of the surfaces: the finer radii of the network's moments.
constexpr float radii[surroundings_radii] = {0.25f, 0.5f};
// A point farther than this from the other surface has no match there; in spacings, as in verify.
constexpr float unmatched_distance = 3.0f;
constexpr float least_weight = 2e-3f;      // what is added before the logarithm
constexpr float most_depth = 0.3f;         // in units of the surfaces
constexpr float least_log_match = -15.0f;  // of the probability of a match

/// Sets nearest_encoded of all points of the surface. False when the deadline has passed before.
bool find_encoded(const Surface& s, float radius, const CloudDescriptors& d, Deadline& deadline,
                  kernels::NeighbourScratch& scratch, JudgedCloud& c) noexcept {
  constexpr Index group = kernels::SpatialIndex::leaf_size;
  c.described.build({d.x.data(), d.y.data(), d.z.data()}, d.count);
  // In spatial order: points that are near each other are searched for together.
  for (Index first = 0; first < s.count; first += group) {
    if (first % 512 == 0 && deadline.passed()) return false;
    const Index count = std::min(group, s.count - first);
    const std::uint32_t* places = s.index.original() + first;
    float x[group], y[group], z[group];
    std::uint16_t nearest[group];
    for (Index i = 0; i < count; ++i) {
      x[i] = radius * s.x[places[i]];
      y[i] = radius * s.y[places[i]];
      z[i] = radius * s.z[places[i]];
    }
    kernels::nearest_places(c.described, {x, y, z}, count, scratch, nearest);
    for (Index i = 0; i < count; ++i) c.nearest_encoded[places[i]] = nearest[i];
  }
  return true;
}

/// The first points of the progressive order that have descriptors of their own.
void choose_points(const Surface& s, const CloudDescriptors& d, JudgedCloud& c) noexcept {
  Index count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count) && count < most_judged_points;
       ++i) {
    const std::uint16_t encoded = c.nearest_encoded[i];
    if (d.encoded[encoded] != s.origin[i]) continue;
    const auto to = static_cast<std::size_t>(count++);
    c.encoded[to] = encoded;
    c.points.x[to] = s.x[i];
    c.points.y[to] = s.y[i];
    c.points.z[to] = s.z[i];
    c.points.normal_x[to] = s.normal_x[i];
    c.points.normal_y[to] = s.normal_y[i];
    c.points.normal_z[to] = s.normal_z[i];
  }
  c.points.count = count;
}

void set_log_sums(const kernels::Floats& sums, Index count, float largest,
                  JudgedCloud& c) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    c.log_sum[i] = largest + std::log(std::max(sums[i], 1e-30f));
  }
}

struct Vector {
  float x, y, z;
};

float dot(const Vector& a, const Vector& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vector turn(const float* r, const Vector& v) noexcept {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}

float inner_product(const kernels::Floats& a, std::size_t i, const kernels::Floats& b,
                    std::size_t j, Index stride) noexcept {
  const auto n = static_cast<std::size_t>(stride);
  const float* left = a.data() + i * n;
  const float* right = b.data() + j * n;
  float sum = 0;
#pragma omp simd reduction(+ : sum)
  for (Index k = 0; k < stride; ++k) sum += left[k] * right[k];
  return sum;
}

/// Sum over the frame vectors of <R a_f, b_f>.
float frame_agreement(const float* r, const kernels::Floats& a, std::size_t i,
                      const kernels::Floats& b, std::size_t j, Index frames) noexcept {
  float sum = 0;
  for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f) {
    const float* p = a.data() + 3 * (i * static_cast<std::size_t>(frames) + f);
    const float* q = b.data() + 3 * (j * static_cast<std::size_t>(frames) + f);
    sum += dot(turn(r, {p[0], p[1], p[2]}), {q[0], q[1], q[2]});
  }
  return sum;
}

Eigen::Matrix3f matrix_of(const float c[6]) noexcept {
  Eigen::Matrix3f m;
  m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return m;
}

/// The numbers of one point, in the order of docs/design.md.
class Writer {
 public:
  explicit Writer(float* out) noexcept : out_(out) {}
  void operator()(float value) noexcept { *out_++ = value; }

 private:
  float* out_;
};

/// One cloud's points, moved onto the other cloud by `motion`.
struct View {
  const Motion& motion;
  const JudgedCloud& moving;
  const JudgedCloud& fixed;
  const Surface& moving_surface;
  const Surface& fixed_surface;
  const CloudDescriptors& moving_descriptors;
  const CloudDescriptors& fixed_descriptors;
  float spacing;
  float radius;
};

/// A judged point: the match at `at` of its block is its own.
struct MatchedPoint {
  const Matches& block;
  std::size_t at;
  std::size_t judged;
};

/// Distance, heights over both planes, normals, and whether the other cloud should show the point.
void write_geometry(const View& v, const MatchedPoint& point, const HalfSpace& cut,
                    Writer& put) noexcept {
  const Matches& m = point.block;
  const std::size_t i = point.at;
  const float h = v.spacing;
  const Vector off{m.x[i] - m.nearest_x[i], m.y[i] - m.nearest_y[i], m.z[i] - m.nearest_z[i]};
  const Vector normal{m.normal_x[i], m.normal_y[i], m.normal_z[i]};
  const Surface& p = v.moving.points;
  const std::size_t j = point.judged;
  const Vector own = turn(v.motion.rotation, {p.normal_x[j], p.normal_y[j], p.normal_z[j]});
  const float distance = std::sqrt(m.squared[i]) / h;
  const float height = std::abs(dot(off, normal)) / h;
  const float cosine = std::abs(dot(own, normal));
  const bool unmatched = distance > unmatched_distance;
  const float depth = cut.count > 0 ? cut.depth(m.x[i], m.y[i], m.z[i]) / most_depth : -1.0f;
  put(std::log1p(distance));
  put(std::log1p(4 * height));
  put(cosine);
  put(unmatched ? 1.0f : 0.0f);
  put(unmatched && depth > 0 ? 1.0f : 0.0f);
  put(std::clamp(depth, -1.0f, 1.0f));
}

/// What lies around the place, in the point's own cloud and in the other one.
void write_surroundings(const View& v, const MatchedPoint& point, float* leaf_bounds,
                        Writer& put) noexcept {
  using RowMajor3f = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3f rotation = Eigen::Map<const RowMajor3f>(v.motion.rotation);
  const Matches& m = point.block;
  const float place[3] = {m.x[point.at], m.y[point.at], m.z[point.at]};
  Surroundings there[surroundings_radii];
  kernels::surroundings(v.fixed_surface.index, place, radii, leaf_bounds, there);
  for (std::size_t r = 0; r < static_cast<std::size_t>(surroundings_radii); ++r) {
    const Surroundings& here = v.moving.own[point.judged][r];
    const Eigen::Vector3f a = rotation * Eigen::Map<const Eigen::Vector3f>(here.offset);
    const Eigen::Vector3f b = Eigen::Map<const Eigen::Vector3f>(there[r].offset);
    const Eigen::Matrix3f spread =
        rotation.lazyProduct(matrix_of(here.covariance)).lazyProduct(rotation.transpose());
    const Eigen::Matrix3f other = matrix_of(there[r].covariance);
    const float weight = std::log(here.weight + least_weight);
    put(weight);
    put(weight - std::log(there[r].weight + least_weight));
    put((a - b).norm());
    put(a.norm());
    put(b.norm());
    put((spread - other).norm());
    put(spread.trace());
    put(other.trace());
  }
}

/// How alike the network finds the point and what lies at its place.
void write_descriptors(const View& v, const MatchedPoint& point, Writer& put) noexcept {
  const Matches& m = point.block;
  const std::size_t i = point.at;
  const CloudDescriptors& a = v.moving_descriptors;
  const CloudDescriptors& b = v.fixed_descriptors;
  const std::size_t p = v.moving.encoded[point.judged];
  const std::size_t q = v.fixed.nearest_encoded[m.place[i]];
  const float local = inner_product(a.local, p, b.local, q, a.local_stride);
  const float context = inner_product(a.context, p, b.context, q, a.context_stride);
  const float log_match = local + context - (v.moving.log_sum[p] + v.fixed.log_sum[q]) / 2;
  const float* r = v.motion.rotation;
  const auto at = static_cast<Index>(q);
  const float dx = v.radius * m.x[i] - b.x[at], dy = v.radius * m.y[i] - b.y[at],
              dz = v.radius * m.z[i] - b.z[at];
  put(local / 10);
  put(context / 10);
  put(std::max(log_match, least_log_match) / 5);
  put(frame_agreement(r, a.local_frames, p, b.local_frames, q, a.frames));
  put(frame_agreement(r, a.context_frames, p, b.context_frames, q, a.frames));
  put(std::log1p(std::sqrt(dx * dx + dy * dy + dz * dz) / (v.radius * v.spacing)));
}

/// Noise and spacing of the pair.
void write_pair(const View& v, Writer& put) noexcept {
  put(v.moving_surface.noise / v.spacing);
  put(v.fixed_surface.noise / v.spacing);
  put(v.spacing);
  put(v.moving_surface.spacing / v.spacing);
  put(v.fixed_surface.spacing / v.spacing);
}

/// The half-space in which most of the points without a match lie.
HalfSpace cut_off(std::span<const Matches> found, float limit, const Extents& extents) noexcept {
  float x[most_judged_points], y[most_judged_points], z[most_judged_points];
  Index count = 0;
  for (const Matches& m : found) {
    for (Index i = 0; i < m.count; ++i) {
      if (!(m.squared[i] > limit * limit)) continue;
      x[count] = m.x[i];
      y[count] = m.y[i];
      z[count++] = m.z[i];
    }
  }
  return most_beyond({x, y, z}, count, extents);
}

/// Matches the first `count` judged points, as many at once as Matches holds.
std::span<const Matches> match_judged(const View& v, Index count,
                                      std::vector<Matches>& room) noexcept {
  std::size_t blocks = 0;
  for (Index first = 0; first < count; first += Matches::capacity) {
    match_points(v.motion, v.moving.points, first, std::min(count - first, Matches::capacity),
                 v.fixed_surface, Search::exact, room[blocks++]);
  }
  return {room.data(), blocks};
}

void write_side(const View& v, Index count, JudgeScratch& s, float* out) noexcept {
  const std::span<const Matches> found = match_judged(v, count, s.matches);
  const HalfSpace cut = cut_off(found, unmatched_distance * v.spacing, v.fixed_surface.extents);
  for (std::size_t point = 0; point < static_cast<std::size_t>(count); ++point) {
    constexpr auto block = static_cast<std::size_t>(Matches::capacity);
    const MatchedPoint p{found[point / block], point % block, point};
    Writer put(out + static_cast<Index>(point) * kernels::padded(judge_point_inputs));
    write_geometry(v, p, cut, put);
    write_surroundings(v, p, s.leaf_bounds.data(), put);
    write_descriptors(v, p, put);
    write_pair(v, put);
  }
}

}  // namespace

void choose_judged_points(Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  parallel_for(w.threads, 2, [&](Index side, int thread) {
    const Surface& s = v.surface[side];
    const CloudDescriptors& d = w.descriptors.features[side].out;
    JudgedCloud& c = v.judge.cloud[side];
    kernels::NeighbourScratch& scratch = w.scratch[static_cast<std::size_t>(thread)].neighbours;
    if (!find_encoded(s, static_cast<float>(v.radius), d, w.deadline, scratch, c)) return;
    choose_points(s, d, c);
    set_log_sums(side == 0 ? v.match.row_sum : v.match.column_sum, d.count, v.match.largest, c);
  });
}

void describe_judged_points(Index first, Index last, Workspace& w) noexcept {
  VerifiedWorkspace& v = w.verified;
  parallel_for(w.threads, 2, [&](Index side, int thread) {
    JudgedCloud& c = v.judge.cloud[side];
    float* bounds = v.judge.scratch[static_cast<std::size_t>(thread)].leaf_bounds.data();
    const auto end = static_cast<std::size_t>(std::min(last, c.points.count));
    for (auto i = static_cast<std::size_t>(first); i < end; ++i) {
      if (i % 16 == 0 && w.deadline.passed()) return;
      const float place[3] = {c.points.x[i], c.points.y[i], c.points.z[i]};
      kernels::surroundings(v.surface[side].index, place, radii, bounds, c.own[i]);
    }
  });
}

Index write_judge_inputs(const Motion& motion, Index most, const Workspace& w,
                         JudgeScratch& s) noexcept {
  const VerifiedWorkspace& v = w.verified;
  const Motion back = inverse(motion);
  Index columns = 0;
  for (Index side = 0; side < 2; ++side) {
    const Index other = 1 - side;
    const Index count = std::min(most, v.judge.cloud[side].points.count);
    write_side({side == 0 ? motion : back, v.judge.cloud[side], v.judge.cloud[other],
                v.surface[side], v.surface[other], w.descriptors.features[side].out,
                w.descriptors.features[other].out, v.spacing, static_cast<float>(v.radius)},
               count, s, s.inputs.data() + columns * kernels::padded(judge_point_inputs));
    columns += count;
  }
  return columns;
}

}  // namespace vnreg::detail
