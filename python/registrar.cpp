// Registrar, PreparedCloud, Cancellation, align and align_many: numpy arrays in, the GIL released
// while the engine works.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "python/builtin_model.hpp"
#include "vnreg/vnreg.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {
namespace {

// Of a batch, so many pairs per thread are aligned between two looks at pending signals.
constexpr std::size_t pairs_per_look = 16;

Mode mode_from(std::string_view name) {
  for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
    if (name == to_string(mode)) return mode;
  }
  std::string got(1, '\'');
  got.append(name).append(1, '\'');
  throw Error(ErrorCode::invalid_option, "mode", "'coarse', 'paper' or 'verified'", got);
}

const Model& chosen_model(const std::optional<Model>& model) {
  return model ? *model : builtin_model();
}

/// A cloud from Python for the time of a call: an array, something that holds points, or a
/// PreparedCloud.
class BorrowedCloud {
 public:
  BorrowedCloud(nb::handle cloud, const char* argument) {
    if (nb::isinstance<PreparedCloud>(cloud)) {
      prepared_ = nb::cast<PreparedCloud>(cloud);
    } else {
      points_.emplace(cloud, argument);
    }
  }

  CloudRef ref() const {
    if (prepared_) return *prepared_;
    return points_->view();
  }

 private:
  std::optional<PreparedCloud> prepared_;
  std::optional<BorrowedPoints> points_;
};

/// A Registrar that Python threads may share: calls wait for each other, without the GIL.
class SharedRegistrar {
 public:
  SharedRegistrar(Model model, const Options& options) : registrar_(std::move(model), options) {}

  Result align(nb::handle source, nb::handle target) {
    const BorrowedCloud x(source, "source");
    const BorrowedCloud y(target, "target");
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.align(x.ref(), y.ref());
  }

  PreparedCloud prepare(nb::handle cloud) {
    const BorrowedPoints points(cloud, "cloud");
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.prepare(points.view());
  }

  std::vector<Stage> stages() {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.stages();
  }

  Explanation explain() {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return registrar_.explain();
  }

 private:
  std::mutex mutex_;
  Registrar registrar_;
};

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

void raise_pending_signals() {
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

/// The pairs of a sequence of (source, target), as long as this object lives.
class BorrowedPairs {
 public:
  explicit BorrowedPairs(nb::handle pairs) {
    std::size_t number = 0;
    for (const nb::handle pair : pairs) {
      std::string name = "pairs[";
      name.append(std::to_string(number++)).append("]");
      if (nb::len_hint(pair) != 2) {
        throw nb::value_error((name + ": expected a source and a target").c_str());
      }
      const nb::object source = pair[0], target = pair[1];
      const BorrowedCloud& x = clouds_.emplace_back(source, (name + "[0]").c_str());
      const BorrowedCloud& y = clouds_.emplace_back(target, (name + "[1]").c_str());
      pairs_.push_back({x.ref(), y.ref()});
    }
  }

  std::span<const CloudPair> view() const noexcept { return pairs_; }

 private:
  std::list<BorrowedCloud> clouds_;  // their places do not change
  std::vector<CloudPair> pairs_;
};

nb::list align_pairs(nb::handle pairs, const std::optional<Model>& model, std::string_view mode,
                     int threads, int max_points, std::uint64_t seed, double time_budget_ms,
                     bool drop_non_finite) {
  const BorrowedPairs borrowed(pairs);
  const std::span<const CloudPair> all = borrowed.view();
  BatchRegistrar batch(chosen_model(model), {mode_from(mode), threads, max_points, seed, false,
                                             time_budget_ms, nullptr, drop_non_finite});
  std::vector<Result> results(all.size());
  const std::size_t chunk = pairs_per_look * static_cast<std::size_t>(batch.threads());
  for (std::size_t first = 0; first < all.size(); first += chunk) {
    raise_pending_signals();
    const std::size_t count = std::min(chunk, all.size() - first);
    const nb::gil_scoped_release unlocked;
    batch.align_many(all.subspan(first, count), std::span(results).subspan(first, count));
  }
  nb::list list;
  for (const Result& result : results) list.append(nb::cast(result));
  return list;
}

void bind_prepared_cloud(nb::module_& module) {
  nb::class_<PreparedCloud>(
      module, "PreparedCloud",
      "A cloud with all that can be computed of it alone, made by Registrar.prepare(). Immutable,\n"
      "may be shared by threads and registrars. Give it to align in place of the array: the\n"
      "answer is the same where its r.m.s. radius is the larger one of the pair. Where the other\n"
      "cloud's is larger by up to a quarter, that cloud is measured in this one's unit; beyond,\n"
      "this one is computed again.")
      .def_prop_ro(
          "status", [](const PreparedCloud& p) { return to_string(p.status()); },
          "'ok', or why no pose is found with it: 'too_few_points', 'not_finite', 'degenerate',\n"
          "'timed_out', 'cancelled'.")
      .def("__len__", &PreparedCloud::size, "Points used, after subsampling.");
}

void bind_cancellation(nb::module_& module) {
  nb::class_<Cancellation>(
      module, "Cancellation",
      "Ends running calls: a registrar that was given it returns within about a millisecond after\n"
      "request(), with status 'cancelled'. Any thread may raise it.")
      .def(nb::init<>())
      .def("request", &Cancellation::request, "Raises the flag, until reset().")
      .def("reset", &Cancellation::reset, "Takes the flag down.")
      .def_prop_ro("requested", &Cancellation::requested, "Whether the flag is raised.");
}

void bind_registrar_class(nb::module_& module) {
  nb::class_<SharedRegistrar>(
      module, "Registrar",
      "Aligns pairs of clouds with one model; keeps its working memory between calls.\n\n"
      "mode: 'verified' (many poses, judged by how well they explain both clouds, and refined),\n"
      "'paper' (the coarse register, then the fine one), or 'coarse' (the coarse one alone).\n"
      "threads: that one call works with; 0 means what OpenMP says, as a rule one per processor.\n"
      "max_points: larger clouds are subsampled to so many, 64 to 16384; 0 means model.points.\n"
      "seed: of the subsampling. record_stages: keep every activation for stages().\n"
      "time_budget_ms: after it align returns with status 'timed_out'; 0 means no limit.\n"
      "cancellation: a Cancellation that ends running calls.\n"
      "drop_non_finite: leave out points with a NaN, infinite or huge coordinate; else the status\n"
      "is 'not_finite'.\n"
      "Threads that share a Registrar wait for each other. Raises Error (invalid_option).")
      .def(
          "__init__",
          [](SharedRegistrar* self, const std::optional<Model>& model, std::string_view mode,
             int threads, int max_points, std::uint64_t seed, bool record_stages,
             double time_budget_ms, const Cancellation* cancellation, bool drop_non_finite) {
            const Options options{mode_from(mode), threads,        max_points,   seed,
                                  record_stages,   time_budget_ms, cancellation, drop_non_finite};
            new (self) SharedRegistrar(chosen_model(model), options);
          },
          "model"_a = nb::none(), nb::kw_only(), "mode"_a = "verified", "threads"_a = 1,
          "max_points"_a = 0, "seed"_a = 0, "record_stages"_a = false, "time_budget_ms"_a = 0.0,
          "cancellation"_a = nb::none(), "drop_non_finite"_a = false, nb::keep_alive<1, 9>())
      .def("align", &SharedRegistrar::align, "source"_a.none(), "target"_a.none(),
           "The pose that maps `source` onto `target`, arrays (N, 3) and (M, 3), PreparedClouds,\n"
           "or point clouds and meshes of Open3D and trimesh (of meshes, 8,192 points of the\n"
           "surface, drawn with a fixed seed).\n\n"
           "float32 and float64 arrays are read in place unless a stride is negative, other real\n"
           "dtypes are copied. Raises ValueError for another shape, TypeError for another kind of\n"
           "array; what is wrong with the points themselves is told by the result's status.")
      .def("prepare", &SharedRegistrar::prepare, "cloud"_a.none(),
           "A PreparedCloud: what align would do for this cloud each time is done once.")
      .def(
          "explain", &SharedRegistrar::explain,
          "What the last align went by, an Explanation: described points, matches, hypotheses;\n"
          "empty before the first one and after prepare(). It costs nothing until it is asked for.")
      .def("stages", &stage_arrays,
           "What the last align computed: {name: array}, float64 (indices int64), names and\n"
           "shapes as in docs/design.md; empty unless record_stages was set.");
}

void bind_functions(nb::module_& module) {
  module.def(
      "align",
      [](nb::handle source, nb::handle target, const std::optional<Model>& model,
         std::string_view mode, int threads, int max_points, std::uint64_t seed,
         double time_budget_ms, bool drop_non_finite) {
        const Options options{mode_from(mode), threads,        max_points, seed,
                              false,           time_budget_ms, nullptr,    drop_non_finite};
        return SharedRegistrar(chosen_model(model), options).align(source, target);
      },
      "source"_a.none(), "target"_a.none(), nb::kw_only(), "model"_a = nb::none(),
      "mode"_a = "verified", "threads"_a = 1, "max_points"_a = 0, "seed"_a = 0,
      "time_budget_ms"_a = 0.0, "drop_non_finite"_a = false,
      "The pose that maps `source` (N, 3) onto `target` (M, 3), from any starting pose.\n\n"
      "model: None means the built-in one. The options are those of Registrar, which is faster\n"
      "for many pairs. Returns a Result. Raises ValueError, TypeError, Error as Registrar does.");
  module.def(
      "align_many", &align_pairs, "pairs"_a, nb::kw_only(), "model"_a = nb::none(),
      "mode"_a = "verified", "threads"_a = 0, "max_points"_a = 0, "seed"_a = 0,
      "time_budget_ms"_a = 0.0, "drop_non_finite"_a = false,
      "The Results of many pairs (source, target), in their order, with one pair per thread at a\n"
      "time. Sources and targets are what Registrar.align takes; time_budget_ms is that of each\n"
      "pair. An interrupt (Ctrl-C) ends the call. Raises as Registrar does.");
}

}  // namespace

void bind_registrar(nb::module_& module) {
  bind_prepared_cloud(module);
  bind_cancellation(module);
  bind_registrar_class(module);
  bind_functions(module);
}

}  // namespace vnreg::python
