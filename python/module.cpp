// The Python module: numpy arrays in, numpy arrays out, the GIL released while the engine works.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "vnreg/vnreg.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {
namespace {

Mode mode_from(std::string_view name) {
  for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
    if (name == to_string(mode)) return mode;
  }
  throw Error(ErrorCode::invalid_option, "mode", "'coarse', 'paper' or 'verified'",
              "'" + std::string(name) + "'");
}

/// A Registrar that Python threads may share: calls wait for each other, without the GIL.
class SharedRegistrar {
 public:
  SharedRegistrar(Model model, const Options& options) : registrar_(std::move(model), options) {}

  Result align(PointsView source, PointsView target) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.align(source, target);
  }

  std::vector<Stage> stages() {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.stages();
  }

 private:
  std::mutex mutex_;
  Registrar registrar_;
};

const Model& builtin_model() {
  static const Model model = Model::builtin();
  return model;
}

const Model& chosen_model(const std::optional<Model>& model) {
  return model ? *model : builtin_model();
}

Result align_arrays(SharedRegistrar& registrar, nb::handle source, nb::handle target) {
  const BorrowedPoints x(source, "source");
  const BorrowedPoints y(target, "target");
  return registrar.align(x.view(), y.view());
}

bool ends_with_index_name(std::string_view name) noexcept {
  return name.ends_with(".kept") || name.ends_with(".match");
}

nb::dict stage_arrays(SharedRegistrar& registrar) {
  nb::dict arrays;
  for (const Stage& stage : registrar.stages()) {
    arrays[stage.name.c_str()] = ends_with_index_name(stage.name)
                                     ? index_array(stage.values, stage.shape)
                                     : float_array(stage.values, stage.shape);
  }
  return arrays;
}

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

void bind_model(nb::module_& module) {
  nb::class_<Model>(module, "Model", "Weights and hyper-parameters; immutable, may be shared.")
      .def_static(
          "load",
          [](nb::handle path) {
            const nb::bytes encoded(nb::module_::import_("os").attr("fsencode")(path));
            const std::string name(encoded.c_str(), encoded.size());
            const nb::gil_scoped_release unlocked;
            return Model::load(name);
          },
          "path"_a, "Reads a `.vnr` file (str or path-like). Raises Error.")
      .def_static(
          "from_bytes",
          [](const nb::bytes& content) {
            const auto* data = static_cast<const std::byte*>(content.data());
            return Model::from_bytes({data, content.size()});
          },
          "content"_a, "Reads a model from the bytes of a `.vnr` file. Raises Error.")
      .def_static("builtin", &builtin_model, "The weights compiled into the library.")
      .def_prop_ro("name", &Model::name, "The model's name, str.")
      .def_prop_ro("points", &Model::points,
                   "Points per cloud that the model was trained with; larger clouds are subsampled "
                   "to as many by default.")
      .def_prop_ro("min_points", &Model::min_points, "The fewest points a cloud must have.")
      .def("__repr__", [](const Model& model) {
        return "vnreg.Model(name='" + std::string(model.name()) +
               "', points=" + std::to_string(model.points()) + ")";
      });
}

void bind_alternative(nb::module_& module) {
  nb::class_<Alternative>(module, "Alternative", "Another pose that fits nearly as well.")
      .def_prop_ro(
          "T_target_source", [](const Alternative& a) { return pose_array(a.T_target_source); },
          "(4, 4) float64: maps source onto target, in input units.")
      .def_ro(
          "score", &Alternative::score,
          "At most 1: how far each cloud's surface lies on the other's, less what contradicts it.");
}

void bind_result(nb::module_& module) {
  nb::class_<Result>(module, "Result", "What an alignment found. target = R source + t.")
      .def_prop_ro(
          "status", [](const Result& r) { return to_string(r.status); },
          "'ok', 'low_confidence' (more likely wrong than right), 'ambiguous' (an alternative\n"
          "fits nearly as well; goes before 'low_confidence'), or without a pose:\n"
          "'too_few_points', 'not_finite', 'degenerate'.")
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
      .def_prop_ro(
          "ms", [](const Result& r) { return milliseconds(r.ms); },
          "Milliseconds: prepare, encode, coarse, fine, hypotheses, verify, measure and total.")
      .def("__repr__", &describe);
}

void bind_registrar(nb::module_& module) {
  nb::class_<SharedRegistrar>(
      module, "Registrar",
      "Aligns pairs of clouds with one model; keeps its working memory between calls.\n\n"
      "mode: 'verified' (many poses, judged by how well they explain both clouds, and refined),\n"
      "'paper' (coarse, then fine register), or 'coarse' (it alone).\n"
      "threads: 0 means what OpenMP says.\n"
      "max_points: larger clouds are subsampled to so many, 64 to 16384; 0 means model.points.\n"
      "seed: of the subsampling. record_stages: keep every activation for stages().\n"
      "Threads that share a Registrar wait for each other. Raises Error (invalid_option).")
      .def(
          "__init__",
          [](SharedRegistrar* self, const std::optional<Model>& model, std::string_view mode,
             int threads, int max_points, std::uint64_t seed, bool record_stages) {
            const Options options{mode_from(mode), threads, max_points, seed, record_stages};
            new (self) SharedRegistrar(chosen_model(model), options);
          },
          "model"_a = nb::none(), nb::kw_only(), "mode"_a = "verified", "threads"_a = 1,
          "max_points"_a = 0, "seed"_a = 0, "record_stages"_a = false)
      .def("align", &align_arrays, "source"_a.none(), "target"_a.none(),
           "The pose that maps `source` onto `target`, arrays (N, 3) and (M, 3).\n\n"
           "float32 and float64 rows are read in place, other real dtypes and layouts are copied.\n"
           "Raises ValueError for another shape, TypeError for another kind of array; what is\n"
           "wrong with the points themselves is told by the result's status.")
      .def("stages", &stage_arrays,
           "What the last align computed: {name: array}, float64 (indices int64), names and\n"
           "shapes as in docs/design.md; empty unless record_stages was set.");
}

void bind_align(nb::module_& module) {
  module.def(
      "align",
      [](nb::handle source, nb::handle target, const std::optional<Model>& model,
         std::string_view mode, int threads, int max_points, std::uint64_t seed) {
        const Options options{mode_from(mode), threads, max_points, seed, false};
        SharedRegistrar registrar(chosen_model(model), options);
        return align_arrays(registrar, source, target);
      },
      "source"_a.none(), "target"_a.none(), nb::kw_only(), "model"_a = nb::none(),
      "mode"_a = "verified", "threads"_a = 1, "max_points"_a = 0, "seed"_a = 0,
      "The pose that maps `source` (N, 3) onto `target` (M, 3), from any starting pose.\n\n"
      "model: None means the built-in one. The options are those of Registrar, which is faster\n"
      "for many pairs. Returns a Result. Raises ValueError, TypeError, Error as Registrar does.");
}

}  // namespace
}  // namespace vnreg::python

NB_MODULE(_vnreg, module) {
  module.doc() = "Rigid registration of two point clouds from any starting pose.";
  module.attr("__version__") = std::string(vnreg::version());
  module.def("instruction_set", &vnreg::instruction_set,
             "The instruction set this build was compiled for, such as 'x86-64-v3'.");
  vnreg::python::bind_error(module);
  vnreg::python::bind_model(module);
  vnreg::python::bind_alternative(module);
  vnreg::python::bind_result(module);
  vnreg::python::bind_registrar(module);
  vnreg::python::bind_align(module);
}
