// Classes Result and Alternative.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "vnreg/vnreg.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {
namespace {

/// NaN where there is no pose: an identity would look like an answer.
Pose pose_or_nan(const Result& result, const Pose& pose) {
  if (result.has_pose) return pose;
  Pose unknown;
  unknown.fill(std::numeric_limits<double>::quiet_NaN());
  return unknown;
}

nb::object pose_array(const Pose& pose) {
  static constexpr std::array<std::size_t, 2> shape{4, 4};
  return float_array(pose, shape);
}

nb::object covariance_array(const Covariance& covariance) {
  static constexpr std::array<std::size_t, 2> shape{6, 6};
  return float_array(covariance, shape);
}

nb::dict evidence_dict(const Evidence& evidence) {
  const auto values = evidence.values();
  nb::dict dict;
  if (std::isnan(evidence.score)) return dict;
  for (std::size_t i = 0; i < values.size(); ++i) {
    dict[nb::str(Evidence::names[i].data(), Evidence::names[i].size())] = values[i];
  }
  return dict;
}

nb::list alternative_list(const Result& result) {
  nb::list list;
  for (const Alternative& alternative : result.alternatives) list.append(nb::cast(alternative));
  return list;
}

nb::dict milliseconds(const StageTimes& ms) {
  nb::dict times;
  times["prepare"] = ms.prepare;
  times["encode"] = ms.encode;
  times["coarse"] = ms.coarse;
  times["fine"] = ms.fine;
  times["hypotheses"] = ms.hypotheses;
  times["verify"] = ms.verify;
  times["measure"] = ms.measure;
  times["total"] = ms.total;
  return times;
}

std::string describe(const Result& result) {
  std::array<char, 192> text;
  std::snprintf(text.data(), text.size(),
                "vnreg.Result(status='%s', confidence=%.3g, overlap=%.3g, rmse=%.4g, ms=%.2f)",
                std::string(to_string(result.status)).c_str(), result.confidence, result.overlap,
                result.rmse, result.ms.total);
  return text.data();
}

Status status_from(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Status::scales_differ); ++i) {
    if (to_string(static_cast<Status>(i)) == name) return static_cast<Status>(i);
  }
  throw nb::value_error("status: not one that this version knows");
}

/// The members of a result by name: what pickle keeps.
nb::dict state_of(const Result& r) {
  nb::dict state;
  state["status"] = to_string(r.status);
  state["has_pose"] = r.has_pose;
  state["T_target_source"] = r.T_target_source;
  state["T_target_source_coarse"] = r.T_target_source_coarse;
  state["covariance"] = r.covariance;
  state["confidence"] = r.confidence;
  state["overlap"] = r.overlap;
  state["rmse"] = r.rmse;
  state["inlier_distance"] = r.inlier_distance;
  state["score"] = r.score;
  state["alternatives"] = std::vector<Alternative>(r.alternatives.begin(), r.alternatives.end());
  state["evidence"] = r.evidence.values();
  state["points_source"] = r.points_source;
  state["points_target"] = r.points_target;
  state["dropped_source"] = r.dropped_source;
  state["dropped_target"] = r.dropped_target;
  state["ms"] = milliseconds(r.ms);
  return state;
}

StageTimes times_from(const nb::dict& ms) {
  const auto of = [&](const char* name) { return nb::cast<double>(ms[name]); };
  return {of("prepare"),    of("encode"), of("coarse"),  of("fine"),
          of("hypotheses"), of("verify"), of("measure"), of("total")};
}

Evidence evidence_from(const std::array<double, Evidence::names.size()>& v) noexcept {
  return {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
}

template <class T>
void take(const nb::dict& state, const char* name, T& member) {
  member = nb::cast<T>(state[name]);
}

Result result_from(const nb::dict& state) {
  Result r;
  r.status = status_from(nb::cast<std::string_view>(state["status"]));
  take(state, "has_pose", r.has_pose);
  take(state, "T_target_source", r.T_target_source);
  take(state, "T_target_source_coarse", r.T_target_source_coarse);
  take(state, "covariance", r.covariance);
  take(state, "confidence", r.confidence);
  take(state, "overlap", r.overlap);
  take(state, "rmse", r.rmse);
  take(state, "inlier_distance", r.inlier_distance);
  take(state, "score", r.score);
  for (const auto& a : nb::cast<std::vector<Alternative>>(state["alternatives"])) {
    if (r.alternatives.size() == Alternatives::capacity) {
      throw nb::value_error("alternatives: too many");
    }
    r.alternatives.push_back(a);
  }
  r.evidence =
      evidence_from(nb::cast<std::array<double, Evidence::names.size()>>(state["evidence"]));
  take(state, "points_source", r.points_source);
  take(state, "points_target", r.points_target);
  take(state, "dropped_source", r.dropped_source);
  take(state, "dropped_target", r.dropped_target);
  r.ms = times_from(nb::cast<nb::dict>(state["ms"]));
  return r;
}

void restore(Result& result, const nb::dict& state) { new (&result) Result(result_from(state)); }

void bind_alternative(nb::module_& module) {
  nb::class_<Alternative>(module, "Alternative", "Another pose that fits nearly as well.")
      .def_prop_ro(
          "T_target_source", [](const Alternative& a) { return pose_array(a.T_target_source); },
          "(4, 4) float64: maps source onto target, in input units.")
      .def_ro(
          "score", &Alternative::score,
          "At most 1: how far each cloud's surface lies on the other's, less what contradicts it.")
      .def("__getstate__",
           [](const Alternative& a) { return std::make_pair(a.T_target_source, a.score); })
      .def("__setstate__", [](Alternative& a, const std::pair<Pose, double>& state) {
        new (&a) Alternative{state.first, state.second};
      });
}

void bind_result_class(nb::module_& module) {
  nb::class_<Result>(module, "Result", "What an alignment found. target = R source + t.")
      .def_prop_ro(
          "status", [](const Result& r) { return to_string(r.status); },
          "'ok', 'low_confidence' (more likely wrong than right), 'ambiguous' (an alternative\n"
          "fits nearly as well; goes before 'low_confidence'), 'scales_differ' (one cloud is more\n"
          "than 3 times as large as the other; goes before 'ambiguous'), or without a pose:\n"
          "'too_few_points', 'not_finite', 'degenerate', 'cancelled'. 'timed_out': has_pose tells\n"
          "whether a pose was found by then, which nothing has judged.")
      .def_ro("has_pose", &Result::has_pose, "Whether there is a pose; if not, the poses are NaN.")
      .def_prop_ro(
          "T_target_source",
          [](const Result& r) { return pose_array(pose_or_nan(r, r.T_target_source)); },
          "(4, 4) float64: the homogeneous matrix that maps source onto target, in input units.")
      .def_prop_ro(
          "T_target_source_coarse",
          [](const Result& r) { return pose_array(pose_or_nan(r, r.T_target_source_coarse)); },
          "(4, 4) float64: the coarse register's answer alone (paper, section III-C).")
      .def_prop_ro(
          "covariance", [](const Result& r) { return covariance_array(r.covariance); },
          "(6, 6) float64, mode 'verified': of the error of T_target_source, provided that it is\n"
          "right; else NaN. The error is (w, v), rotation vector in radians and translation in\n"
          "input units, in the target's frame: T_true = [exp([w]x), v; 0, 1] T_target_source.")
      .def_ro("confidence", &Result::confidence,
              "Calibrated probability that the pose is right (within 5 degrees and 0.2 of the\n"
              "longest side; in mode 'verified' up to the object's symmetry); NaN where the model\n"
              "has no calibration of the mode.")
      .def_ro("overlap", &Result::overlap,
              "Share of the points of both clouds with a neighbour within `inlier_distance`.")
      .def_ro("rmse", &Result::rmse, "Root mean square distance of those inliers, input units.")
      .def_ro("inlier_distance", &Result::inlier_distance, "Input units.")
      .def_ro("score", &Result::score,
              "Mode 'verified': at most 1, how far each cloud's surface lies on the other's, less "
              "what\n"
              "contradicts it; else NaN.")
      .def_prop_ro("alternatives", &alternative_list,
                   "Mode 'verified': the other poses that fit nearly as well, the best first.")
      .def_prop_ro(
          "evidence", [](const Result& r) { return evidence_dict(r.evidence); },
          "{name: float}, mode 'verified': what the confidence is computed from; else empty.\n"
          "score, margin (over the next pose), shares of points: covered (have a match),\n"
          "contradicted (have none where they should), beyond (the other cloud ends before them);\n"
          "residual and noise (r.m.s. distances from planes, in point spacings), certainty (log10\n"
          "of the information on the rotation).")
      .def_ro("points_source", &Result::points_source, "Points used, after subsampling.")
      .def_ro("points_target", &Result::points_target, "Points used, after subsampling.")
      .def_ro("dropped_source", &Result::dropped_source, "Points left out by drop_non_finite.")
      .def_ro("dropped_target", &Result::dropped_target, "Points left out by drop_non_finite.")
      .def_prop_ro(
          "ms", [](const Result& r) { return milliseconds(r.ms); },
          "Milliseconds: prepare, encode, coarse, fine, hypotheses, verify, measure and total.")
      .def("__repr__", &describe)
      .def("__getstate__", &state_of)
      .def("__setstate__", &restore);
}

}  // namespace

void bind_result(nb::module_& module) {
  bind_alternative(module);
  bind_result_class(module);
}

}  // namespace vnreg::python
