// Class Explanation, and the viewer's page.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "viewer/view.hpp"
#include "vnreg/vnreg.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vnreg::python {
namespace {

nb::object rows_array(const std::vector<double>& values, std::size_t columns) {
  const std::array<std::size_t, 2> shape{values.size() / columns, columns};
  return float_array(values, shape);
}

nb::object list_array(const std::vector<double>& values) {
  const std::array<std::size_t, 1> shape{values.size()};
  return float_array(values, shape);
}

nb::object places(const std::vector<Explanation::Point>& points) {
  std::vector<double> values;
  for (const auto& point : points) {
    values.insert(values.end(), point.position.begin(), point.position.end());
  }
  return rows_array(values, 3);
}

nb::object significances(const std::vector<Explanation::Point>& points) {
  std::vector<double> values;
  for (const auto& point : points) values.push_back(point.significance);
  return list_array(values);
}

nb::object match_ends(const std::vector<Explanation::Match>& matches) {
  std::vector<double> values;
  for (const auto& match : matches) {
    values.push_back(match.source);
    values.push_back(match.target);
  }
  const std::array<std::size_t, 2> shape{matches.size(), 2};
  return index_array(values, shape);
}

nb::object match_weights(const std::vector<Explanation::Match>& matches) {
  std::vector<double> values;
  for (const auto& match : matches) values.push_back(match.weight);
  return list_array(values);
}

nb::list hypothesis_list(const Explanation& explanation) {
  nb::list list;
  for (const Alternative& pose : explanation.hypotheses) list.append(nb::cast(pose));
  return list;
}

void bind_explanation(nb::module_& module) {
  nb::class_<Explanation>(module, "Explanation",
                          "What an answer was found by, from Registrar.explain().")
      .def_prop_ro(
          "source", [](const Explanation& e) { return places(e.source); },
          "(N, 3) float64: the source's points that the network described.")
      .def_prop_ro(
          "target", [](const Explanation& e) { return places(e.target); },
          "(M, 3) float64: likewise of the target.")
      .def_prop_ro(
          "source_significance", [](const Explanation& e) { return significances(e.source); },
          "(N,) float64, 0 to 1: how much the network expects of each point's best match.")
      .def_prop_ro(
          "target_significance", [](const Explanation& e) { return significances(e.target); },
          "(M,) float64: likewise of the target.")
      .def_prop_ro(
          "matches", [](const Explanation& e) { return match_ends(e.matches); },
          "(K, 2) int64: indices into source and target of the matches that proposed poses, the\n"
          "heaviest first.")
      .def_prop_ro(
          "match_weights", [](const Explanation& e) { return match_weights(e.matches); },
          "(K,) float64: how much each counts.")
      .def_prop_ro(
          "hypotheses", &hypothesis_list,
          "The poses between which was decided, the best first; Alternatives. In mode\n"
          "'paper' the pose and the coarse one, in mode 'coarse' the pose; scores are NaN.");
}

}  // namespace

void bind_viewer(nb::module_& module) {
  bind_explanation(module);
  module.attr("VIEW_PLACEHOLDER") = std::string(viewer::data_placeholder);
  module.def("view_template", &viewer::view_template,
             "The viewer's page without data, str: what stands where VIEW_PLACEHOLDER is becomes\n"
             "View.data. For pages that show many pairs.");
  module.def(
      "_view_data",
      [](nb::handle source, nb::handle target, const Result& result, const Explanation* explanation,
         std::string_view source_name, std::string_view target_name, std::string_view model,
         std::string_view mode) {
        const BorrowedPoints x(source, "source");
        const BorrowedPoints y(target, "target");
        return viewer::view_data(
            {x.view(), y.view(), source_name, target_name, result, explanation, model, mode});
      },
      "source"_a, "target"_a, "result"_a, "explanation"_a.none(), "source_name"_a, "target_name"_a,
      "model"_a, "mode"_a, "What vnreg.view() shows, as JSON.");
}

}  // namespace vnreg::python
