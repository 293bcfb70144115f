// Two small odd clouds, made from the bytes, to a tiny model: whatever they are, align answers with
// a rigid pose or with a status that says why there is none, and says the same when asked again.
#include <fuzzer/FuzzedDataProvider.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "random_descriptor_model.hpp"
#include "require.hpp"

namespace vnreg::fuzz {
namespace {

using Points = std::vector<std::array<double, 3>>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

double number(FuzzedDataProvider& bytes) {
  switch (bytes.ConsumeIntegralInRange(0, 4)) {
    case 0:
      return bytes.ConsumeIntegralInRange(-4, 4);
    case 1:
      return bytes.ConsumeFloatingPointInRange(-1.0, 1.0);
    case 2:
      return bytes.ConsumeFloatingPointInRange(-1.0, 1.0) * 1e-4 + 1e7;
    case 3:
      return std::ldexp(bytes.ConsumeFloatingPointInRange(-1.0, 1.0),
                        bytes.ConsumeIntegralInRange(-1074, 1023));
    default:
      return bytes.ConsumeFloatingPoint<double>();
  }
}

/// Points by a law of few numbers, so that clouds that a network can make something of are common.
Points lawful(FuzzedDataProvider& bytes, std::size_t count) {
  const double step[3] = {number(bytes), number(bytes), number(bytes)};
  const double offset[3] = {number(bytes), number(bytes), number(bytes)};
  const auto period = bytes.ConsumeIntegralInRange<std::size_t>(1, 64);
  Points points(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto turn = static_cast<double>((i % period) * (axis + 1));
      points[i][axis] = offset[axis] + step[axis] * std::sin(turn + static_cast<double>(axis));
    }
  }
  return points;
}

Points cloud(FuzzedDataProvider& bytes) {
  const auto count = bytes.ConsumeIntegralInRange<std::size_t>(0, 120);
  Points points = lawful(bytes, count);
  // A few points of any kind among them.
  for (auto odd = bytes.ConsumeIntegralInRange(0, 8); odd > 0 && count > 0; --odd) {
    points[bytes.ConsumeIntegralInRange<std::size_t>(0, count - 1)] = {number(bytes), number(bytes),
                                                                       number(bytes)};
  }
  return points;
}

Points target_of(FuzzedDataProvider& bytes, const Points& source) {
  if (bytes.ConsumeBool()) return cloud(bytes);
  // The source again: mirrored, turned by half a turn, scaled, moved or as it is.
  const double scale = bytes.ConsumeBool() ? 1.0 : number(bytes);
  const double sign[3] = {bytes.ConsumeBool() ? 1.0 : -1.0, bytes.ConsumeBool() ? 1.0 : -1.0,
                          bytes.ConsumeBool() ? 1.0 : -1.0};
  const double shift = bytes.ConsumeBool() ? 0.0 : number(bytes);
  Points target = source;
  for (auto& point : target) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[axis] = sign[axis] * scale * point[axis] + shift;
  }
  return target;
}

bool all_finite(const Points& points) {
  for (const auto& p : points) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) return false;
  }
  return true;
}

void check_rigid(const Pose& pose) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> m(pose.data());
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  require(m.allFinite(), "a pose is finite");
  require((r * r.transpose()).isIdentity(1e-9), "a rotation is orthonormal");
  require(std::abs(r.determinant() - 1) < 1e-9, "a rotation is no reflection");
  require(m.row(3) == Eigen::RowVector4d(0, 0, 0, 1), "a pose ends with 0 0 0 1");
}

void check_covariance(const Covariance& covariance) {
  const Matrix6 c = Eigen::Map<const Matrix6>(covariance.data());
  if (c.hasNaN()) return;
  require(c.allFinite() && c == c.transpose(), "a covariance is finite and symmetric");
  // To unit diagonal first: radians and lengths differ by the unit of the input.
  const Eigen::Matrix<double, 6, 1> deviation = c.diagonal().cwiseSqrt();
  require((deviation.array() > 0).all(), "variances are positive");
  const Matrix6 unit =
      deviation.cwiseInverse().asDiagonal() * c * deviation.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(unit, Eigen::EigenvaluesOnly);
  require(solver.eigenvalues()(0) >= -1e-9, "a covariance is positive semi-definite");
}

void check(const Result& r, bool finite) {
  require(finite || !r.has_pose, "no pose where a coordinate is no number");
  require(finite || (r.status != Status::ok && r.status != Status::low_confidence),
          "nor such a status");
  check_rigid(r.T_target_source);
  check_rigid(r.T_target_source_coarse);
  check_covariance(r.covariance);
  require(std::isnan(r.confidence) || (r.confidence >= 0 && r.confidence <= 1), "a probability");
  require(r.overlap >= 0 && r.overlap <= 1, "a share");
  require(std::isfinite(r.rmse), "a length");
  require(r.has_pose || r.T_target_source == identity_pose, "no pose is the identity");
  require(r.has_pose || std::isnan(r.confidence), "no pose has no confidence");
  for (const Alternative& a : r.alternatives) check_rigid(a.T_target_source);
}

Registrar& registrar(Mode mode) {
  static const Model paper =
      test::random_model({.global = 4, .local = 4, .descriptor = 4, .pair = 4, .neighbours = 4})
          .build();
  static const Model vnreg =
      test::random_descriptor_model({.vectors = 4, .scalars = 4, .local = 4, .context = 4}).build();
  static Registrar coarse(paper, {.mode = Mode::coarse, .threads = 1});
  static Registrar fine(paper, {.mode = Mode::paper, .threads = 1, .max_points = 64});
  static Registrar verified(vnreg, {.mode = Mode::verified, .threads = 1, .max_points = 64});
  return mode == Mode::coarse ? coarse : mode == Mode::paper ? fine : verified;
}

void align(FuzzedDataProvider& bytes) {
  static constexpr Mode modes[] = {Mode::coarse, Mode::paper, Mode::verified};
  Registrar& engine = registrar(bytes.PickValueInArray(modes));
  const bool prepared = bytes.ConsumeIntegralInRange(0, 7) == 0;
  const Points source = cloud(bytes);
  const Points target = target_of(bytes, source);
  const Result first = engine.align(source, target);
  check(first, all_finite(source) && all_finite(target));
  const Result second =
      prepared ? engine.align(source, engine.prepare(target)) : engine.align(source, target);
  check(second, all_finite(source) && all_finite(target));
  if (prepared) return;  // it fixes the unit of length, so the bits differ
  require(first.status == second.status && first.T_target_source == second.T_target_source,
          "the same question has the same answer");
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  vnreg::fuzz::align(bytes);
  return 0;
}
