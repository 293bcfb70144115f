/// @file
/// vnreg: the rigid pose between two point clouds of one object, from any starting pose.
///
/// @code
/// auto result = vnreg::align(source, target);                     // one call, built-in model
///
/// vnreg::Model model = vnreg::Model::load("models/small.vnr");    // or Model::builtin()
/// vnreg::Registrar registrar{model, {.threads = 1}};              // owns all working memory
/// const vnreg::Result& result = registrar.align(source, target);  // hot path, never throws
///
/// vnreg::PreparedCloud part = registrar.prepare(target);          // many scans, one target
/// registrar.align(scan, part);
/// @endcode
///
/// Conventions: target = R * source + t. Poses are 4x4, row-major, in the units of the input.
///
/// Thread safety: Model and PreparedCloud are immutable and may be shared by any number of threads.
/// A Registrar or BatchRegistrar serves one call at a time: use one per thread. Cancellation may be
/// raised from any thread. The free functions may be called at the same time.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vnreg/cancellation.hpp"
#include "vnreg/error.hpp"
#include "vnreg/export.hpp"
#include "vnreg/points.hpp"

/// Everything of vnreg in C++.
namespace vnreg {

/// The version of the library, for example "0.1.0".
VNREG_API std::string_view version() noexcept;
/// The instruction set this build was compiled for, for example "x86-64-v3".
VNREG_API std::string_view instruction_set() noexcept;

/// Row-major 4x4 homogeneous matrix.
using Pose = std::array<double, 16>;
/// Neither turns nor moves.
inline constexpr Pose identity_pose{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// How a pose is looked for.
enum class Mode {
  coarse,    ///< the global register alone (paper, section III-C)
  paper,     ///< coarse, then the fine register (paper, sections III-C and III-D)
  verified,  ///< these poses and many others, judged by how well they explain both clouds, and
             ///< refined (the default; not part of the paper)
};

/// What became of a call.
enum class Status {
  ok,              ///< a pose was found
  low_confidence,  ///< a pose was found, but it is more likely wrong than right (confidence < 1/2)
  too_few_points,  ///< a cloud has fewer points than the network needs: no pose
  not_finite,      ///< a coordinate is NaN, infinite or beyond 1e300: no pose
  degenerate,  ///< a cloud's points coincide or lie on a line, or determine no rotation: no pose
  ambiguous,   ///< mode verified: a pose was found, but another fits nearly as well (a symmetry);
               ///< it goes before low_confidence: it says more
  timed_out,  ///< the time budget was spent; has_pose tells whether a pose was found by then, which
              ///< nothing has judged: confidence, covariance and overlap are unknown
  cancelled,  ///< Options::cancellation was raised: no pose
  scales_differ,  ///< a pose was found, but the r.m.s. radius of one cloud is more than 3 times the
                  ///< other's: different units, or a small part? It goes before ambiguous
};

/// The mode's name as it is written above.
VNREG_API std::string_view to_string(Mode mode) noexcept;
/// The status's name as it is written above.
VNREG_API std::string_view to_string(Status status) noexcept;

/// What a registrar is made with. Checked there: fields out of their range throw Error
/// (invalid_option), which names the field.
struct Options {
  /// How poses are looked for. Mode::paper needs a model of that architecture.
  Mode mode = Mode::verified;
  /// OpenMP threads of one align call; 0 means what OpenMP says. With 1, no parallel region opens:
  /// the choice for processors that other programs use, too, unless OpenMP's threads may sleep
  /// while they wait (OMP_WAIT_POLICY=passive in the program's environment).
  int threads = 0;
  /// Clouds with more points are subsampled to this many (64 to 16,384); 0 means what the model
  /// was trained with.
  int max_points = 0;
  /// Seed of the subsampling. The same input, options and model give the same bits.
  std::uint64_t seed = 0;
  /// Keep every intermediate activation for Registrar::stages(). Allocates; for tests and tools.
  bool record_stages = false;
  /// Milliseconds after which align returns, with Status::timed_out unless it is done; 0 means no
  /// limit, at most 1e9. The clock is read before every piece of work; the pieces last less than a
  /// millisecond.
  double time_budget_ms = 0;
  /// Ends running calls when it is raised: see Cancellation. Not owned.
  const Cancellation* cancellation = nullptr;
  /// Leaves out points with a coordinate that is NaN, infinite or beyond 1e300, as if they had not
  /// been given, where Status::not_finite would refuse the cloud: see Result::dropped_source.
  bool drop_non_finite = false;
};

/// How long the parts of a call took, in milliseconds.
struct StageTimes {
  double prepare = 0;     ///< check, subsample, normalise, neighbourhoods
  double encode = 0;      ///< the SE(3)-equivariant network on both clouds
  double coarse = 0;      ///< global register
  double fine = 0;        ///< elimination and the iterations of the fine register
  double hypotheses = 0;  ///< mode verified: normals, and poses proposed by pairs of points
  double verify = 0;      ///< mode verified: comparison and refinement of the poses
  double measure = 0;     ///< residual and overlap of the final pose
  double total = 0;       ///< the whole call
};

/// A pose that fits the clouds, and how well.
struct Alternative {
  Pose T_target_source = identity_pose;  ///< target = T * source, in the units of the input
  /// What poses are ranked by. Of a model with a judge: its log-odds that the pose is right, before
  /// calibration, and up to 20 more for points that both clouds hold to the last digits. Else how
  /// far each cloud's surface lies on the other's, less what contradicts the pose: at most 1, of
  /// identical surfaces.
  double score = 0;
};

/// Up to four alternatives, the best first.
class Alternatives {
 public:
  /// The most there can be.
  static constexpr std::size_t capacity = 4;

  /// How many there are.
  std::size_t size() const noexcept { return size_; }
  /// Whether there is none.
  bool empty() const noexcept { return size_ == 0; }
  /// For range-based loops.
  const Alternative* begin() const noexcept { return items_.data(); }
  /// For range-based loops.
  const Alternative* end() const noexcept { return items_.data() + size_; }
  /// The one with rank `i`, less than size(), not checked.
  const Alternative& operator[](std::size_t i) const noexcept { return items_[i]; }
  /// Adds one. Must not be full.
  void push_back(const Alternative& alternative) noexcept { items_[size_++] = alternative; }

 private:
  std::array<Alternative, capacity> items_;
  std::size_t size_ = 0;
};

/// Row-major 6x6 covariance of a pose's error (w, v): rotation vector w in radians, then
/// translation v in the units of the input. The error is a perturbation from the left, in the
/// target's frame and about its origin: R_true = exp([w]x) R and t_true = exp([w]x) t + v for the
/// pose (R, t), so T_true = [exp([w]x), v; 0, 1] * T_target_source.
using Covariance = std::array<double, 36>;
/// NaN everywhere.
inline constexpr Covariance unknown_covariance = [] {
  Covariance c{};
  c.fill(std::numeric_limits<double>::quiet_NaN());
  return c;
}();

/// What the confidence of mode verified is computed from; lengths are relative to the distance of
/// neighbouring points (the sparser cloud's).
struct Evidence {
  double score = std::numeric_limits<double>::quiet_NaN();  ///< of the pose
  double margin = score;   ///< 1 - odds of the second best pose / odds; 1 where there is none
  double covered = score;  ///< share of the points of both clouds that have a match in the other
  double contradicted = score;  ///< share without, where the other cloud should show something
  double beyond = score;        ///< share without, outside of what the other cloud shows
  double residual = score;   ///< r.m.s. distance of matched points from the planes of their matches
  double noise = score;      ///< r.m.s. distance of points from the planes of their own cloud
  double certainty = score;  ///< log10 of the least eigenvalue of the information that a matched
                             ///< point gives on the rotation: how well the shape holds it

  /// The names of the fields.
  static constexpr std::array<std::string_view, 8> names{
      "score", "margin", "covered", "contradicted", "beyond", "residual", "noise", "certainty"};
  /// The fields in the order of the names.
  std::array<double, names.size()> values() const noexcept {
    return {score, margin, covered, contradicted, beyond, residual, noise, certainty};
  }
};

/// The answer of a call.
struct Result {
  Status status = Status::degenerate;    ///< whether there is a pose, and how good, or why not
  bool has_pose = false;                 ///< false: the poses below are the identity
  Pose T_target_source = identity_pose;  ///< target = T * source, in the units of the input
  Pose T_target_source_coarse = identity_pose;  ///< the coarse register's answer alone; the
                                                ///< identity where it has none (mode verified only)
  /// Mode verified: of T_target_source, provided that it is right. Else NaN.
  Covariance covariance = unknown_covariance;
  /// Probability that the pose is right: within 5 degrees and 0.2 of the longest side, in mode
  /// verified up to the object's symmetry. NaN where the model carries no calibration of the mode.
  double confidence = std::numeric_limits<double>::quiet_NaN();
  /// Share of points (both clouds) whose nearest point in the other cloud is within
  /// `inlier_distance`.
  double overlap = 0;
  double rmse = 0;  ///< root mean square nearest-point distance of those inliers, input units
  double inlier_distance = 0;  ///< input units
  /// Mode verified: the score of T_target_source (see Alternative::score). Else NaN.
  double score = std::numeric_limits<double>::quiet_NaN();
  /// Mode verified: the other poses that score nearly as well (at most 4 less; without a judge, at
  /// least 80 %) and differ from T_target_source and from each other by 15 degrees or 0.1 r.m.s.
  /// radii. Else none.
  Alternatives alternatives;
  Evidence evidence;               ///< mode verified; else NaN
  std::size_t points_source = 0;   ///< points used, after subsampling
  std::size_t points_target = 0;   ///< points used, after subsampling
  std::size_t dropped_source = 0;  ///< points left out by Options::drop_non_finite
  std::size_t dropped_target = 0;  ///< points left out by Options::drop_non_finite
  StageTimes ms;                   ///< how long the call took
};

/// One recorded activation, row-major, as torch holds it. See docs/design.md for names and shapes.
struct Stage {
  std::string name;                ///< for example "source.descriptor"
  std::vector<std::size_t> shape;  ///< as torch has it
  std::vector<double> values;      ///< row-major
};

/// What an answer was found by, for people to look at: see Registrar::explain().
struct Explanation {
  /// A point that the network described.
  struct Point {
    std::array<double, 3> position{};  ///< in its cloud's frame and units
    double significance = 0;  ///< 0 to 1: how much the network expects of the point's best match
  };
  /// A point of the source and the point of the target that it was taken for.
  struct Match {
    std::uint32_t source = 0;  ///< index into Explanation::source
    std::uint32_t target = 0;  ///< index into Explanation::target
    double weight = 0;         ///< at least 0; the larger, the more it counts
  };

  std::vector<Point> source;  ///< of architecture `paper` all that were used, else the encoded ones
  std::vector<Point> target;  ///< likewise
  /// Those that proposed poses, the heaviest first. Architecture `vnreg`: at most 256, the weight
  /// is the probability of the match by dual softmax, times both significances. Architecture
  /// `paper`: of the fine register's last iteration, the weights add up to 1.
  std::vector<Match> matches;
  /// Mode verified: the poses (at most 12) between which was decided, the best first, with the
  /// scores of that decision; the result's pose and alternatives are among them. Else the result's
  /// pose, in mode paper followed by the coarse one; scores are NaN.
  std::vector<Alternative> hypotheses;
};

namespace detail {
struct ModelData;
struct PreparedData;
struct RegistrarState;
struct BatchState;
}  // namespace detail

/// Weights and hyper-parameters, checked and packed. Cheap to copy (shared, immutable).
class VNREG_API Model {
 public:
  /// Reads a `.vnr` file. Throws Error: unsupported_cpu, file_unreadable, not_a_model,
  /// unsupported_version, corrupt_model, wrong_architecture or missing_tensor.
  static Model load(const std::string& path);
  /// Reads a model from memory; `bytes` may be released afterwards. Throws as load() does.
  static Model from_bytes(std::span<const std::byte> bytes);
  /// The weights compiled into the library. Throws Error: unsupported_cpu, or file_unreadable if
  /// the library was built without them.
  static Model builtin();

  /// What the file says it is called.
  std::string_view name() const noexcept;
  /// Points per cloud that the model was trained with.
  int points() const noexcept;
  /// The fewest points a cloud must have.
  int min_points() const noexcept;

  /// For the library itself.
  const detail::ModelData& data() const noexcept { return *data_; }

 private:
  explicit Model(std::shared_ptr<const detail::ModelData> data) : data_(std::move(data)) {}
  std::shared_ptr<const detail::ModelData> data_;
};

/// A cloud with all that can be computed of it alone: its points, their neighbourhoods, its
/// features and its surface. Made by Registrar::prepare(). Cheap to copy (shared, immutable).
///
/// The network sees both clouds of a pair in units of one length, the larger r.m.s. radius. A
/// prepared cloud fixes it: aligned with a cloud whose radius is no larger, as a scan's is most of
/// the time if the model is prepared, it gives the same bits as its points would. A radius up to
/// 1.25 times as large is accepted, too, and measured in the prepared cloud's unit; beyond that,
/// and where two prepared clouds differ in radius, the points of the smaller one are encoded again,
/// which takes the time that it would without. Registrars with another model, max_points, seed or
/// mode than that which made it take its points as if they had been given.
class VNREG_API PreparedCloud {
 public:
  /// Status::ok, or why no registrar finds a pose with it: too_few_points, not_finite, degenerate;
  /// timed_out or cancelled when its registrar's limits were met.
  Status status() const noexcept;
  /// Points used, after subsampling.
  std::size_t size() const noexcept;

  /// For the library itself.
  const detail::PreparedData& data() const noexcept { return *data_; }

 private:
  friend class Registrar;
  explicit PreparedCloud(std::shared_ptr<const detail::PreparedData> data)
      : data_(std::move(data)) {}
  std::shared_ptr<const detail::PreparedData> data_;
};

/// A cloud to align: points, as a PointsView or whatever makes one, or a prepared cloud. Borrowed
/// for the time of the call.
class CloudRef {
 public:
  /// A prepared cloud.
  CloudRef(const PreparedCloud& prepared) noexcept  // NOLINT: implicit on purpose
      : points_(static_cast<const float*>(nullptr), 0), prepared_(&prepared.data()) {}
  /// Points: whatever a PointsView is made of.
  template <class... Args>
  requires std::constructible_from<PointsView, Args...> CloudRef(
      Args&&... args)  // NOLINT: implicit on purpose
      : points_(std::forward<Args>(args)...) {}

  /// The points; none if it is a prepared cloud.
  const PointsView& points() const noexcept { return points_; }
  /// For the library itself; null if it is given by its points.
  const detail::PreparedData* prepared() const noexcept { return prepared_; }

 private:
  PointsView points_;
  const detail::PreparedData* prepared_ = nullptr;
};

/// Aligns pairs of clouds with one model. Owns its working memory; one per thread.
class VNREG_API Registrar {
 public:
  /// Makes all working memory. Throws Error (invalid_option).
  explicit Registrar(Model model, Options options = {});
  ~Registrar();
  /// It may be moved; of what it was moved from nothing but its end may be asked.
  Registrar(Registrar&&) noexcept;
  /// As the move constructor.
  Registrar& operator=(Registrar&&) noexcept;
  Registrar(const Registrar&) = delete;
  Registrar& operator=(const Registrar&) = delete;

  /// The pose that maps `source` onto `target`. Valid until the next call. Never throws: look at
  /// `status` (any finite or non-finite input is allowed). Allocates nothing.
  const Result& align(CloudRef source, CloudRef target) noexcept;

  /// Does once what align would do for this cloud each time. Throws std::bad_alloc only; look at
  /// the status of what it returns. What align returned before stays valid.
  PreparedCloud prepare(PointsView cloud);

  /// What the last align computed, in the order of computation; empty unless record_stages is set.
  const std::vector<Stage>& stages() const noexcept;

  /// What the last align went by, as far as it came; empty before the first one and after
  /// prepare(). Made from working memory when it is asked for, so align itself is as fast as ever.
  /// Throws std::bad_alloc only.
  Explanation explain() const;

 private:
  std::unique_ptr<detail::RegistrarState> state_;
};

/// What align_many aligns. Borrowed for the time of the call.
struct CloudPair {
  CloudRef source;  ///< is mapped onto the target
  CloudRef target;  ///< stays where it is
};

/// Aligns many pairs, one per thread at a time: for throughput, where Registrar is for latency. The
/// results are those of a Registrar, bit by bit.
class VNREG_API BatchRegistrar {
 public:
  /// `options.threads` pairs are worked on at a time, each with working memory of its own; the time
  /// budget is that of each pair. Throws Error (invalid_option); stages cannot be recorded.
  explicit BatchRegistrar(Model model, Options options = {});
  ~BatchRegistrar();
  /// It may be moved; of what it was moved from nothing but its end may be asked.
  BatchRegistrar(BatchRegistrar&&) noexcept;
  /// As the move constructor.
  BatchRegistrar& operator=(BatchRegistrar&&) noexcept;
  BatchRegistrar(const BatchRegistrar&) = delete;
  BatchRegistrar& operator=(const BatchRegistrar&) = delete;

  /// results[i] is that of pairs[i]; of what is in only one of both spans nothing is done.
  /// Allocates nothing and never throws. A cancellation leaves the remaining results with
  /// Status::cancelled.
  void align_many(std::span<const CloudPair> pairs, std::span<Result> results) noexcept;

  /// As Registrar::prepare().
  PreparedCloud prepare(PointsView cloud);

  /// How many pairs are worked on at a time.
  int threads() const noexcept;

 private:
  std::unique_ptr<detail::BatchState> state_;
};

/// One call with the built-in model. Loads the model at its first use (thread-safe), and makes a
/// registrar each time. Throws as Model::builtin() and Registrar do.
VNREG_API Result align(CloudRef source, CloudRef target, const Options& options = {});
/// The same for many pairs, by a BatchRegistrar; the results are in the order of the pairs.
VNREG_API std::vector<Result> align_many(std::span<const CloudPair> pairs,
                                         const Options& options = {});

}  // namespace vnreg
