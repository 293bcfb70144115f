#include "align_command.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "align_report.hpp"
#include "cloud_file/cloud_file.hpp"
#include "cloud_file/ply_writer.hpp"
#include "cloud_file/text_scan.hpp"
#include "html_view.hpp"
#include "rotation.hpp"

namespace vnreg::cli {
namespace {

using cloud_file::Points;

struct NamedCloud {
  const std::string& path;
  const Points& points;
};

[[noreturn]] void refuse_input(const std::string& path, const std::string& message) {
  throw CommandError(ExitCode::input, path + ": " + message);
}

bool is_finite(const std::array<double, 3>& point) {
  return std::ranges::all_of(point, [](double value) { return std::isfinite(value); });
}

void refuse_if_not_finite(const NamedCloud& cloud) {
  const auto bad = std::ranges::find_if_not(cloud.points, is_finite);
  if (bad == cloud.points.end()) return;
  const auto& [x, y, z] = *bad;
  refuse_input(cloud.path, "point " + std::to_string(bad - cloud.points.begin() + 1) +
                               ": expected finite coordinates, found " + number_text(x, 6) + " " +
                               number_text(y, 6) + " " + number_text(z, 6));
}

void refuse_if_too_few(const NamedCloud& cloud, int min_points) {
  if (cloud.points.size() >= static_cast<std::size_t>(min_points)) return;
  refuse_input(cloud.path, "expected at least " + std::to_string(min_points) + " points, found " +
                               std::to_string(cloud.points.size()));
}

void refuse_if_all_equal(const NamedCloud& cloud) {
  const auto& points = cloud.points;
  if (std::ranges::adjacent_find(points, std::ranges::not_equal_to{}) != points.end()) return;
  refuse_input(cloud.path, "expected points that differ, found " + std::to_string(points.size()) +
                               " equal points");
}

/// Says which cloud is to blame for a result without a pose.
[[noreturn]] void refuse_clouds(const Result& result, const NamedCloud& source,
                                const NamedCloud& target, int min_points) {
  for (const NamedCloud& cloud : {source, target}) {
    switch (result.status) {
      case Status::too_few_points:
        refuse_if_too_few(cloud, min_points);
        break;
      case Status::not_finite:
        refuse_if_not_finite(cloud);
        break;
      case Status::degenerate:
        refuse_if_all_equal(cloud);
        break;
      case Status::ok:
      case Status::low_confidence:
      case Status::ambiguous:
      case Status::scales_differ:
      case Status::timed_out:
      case Status::cancelled:
        break;
    }
  }
  refuse_input(source.path + " and " + target.path,
               "expected clouds that determine a rotation, found status " +
                   std::string(to_string(result.status)));
}

void write_moved(const std::string& path, const Points& source, const Pose& pose) {
  Points moved(source.size());
  std::ranges::transform(source, moved.begin(),
                         [&](const auto& point) { return transform(pose, point); });
  try {
    cloud_file::write_ply(path, moved);
  } catch (const cloud_file::CloudFileError& error) {
    throw CommandError(ExitCode::failure, error.what());
  }
}

std::array<double, 3> middle_of(const Points& points) {
  std::array<double, 3> middle{};
  for (const auto& point : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      middle[axis] += point[axis] / static_cast<double>(points.size());
    }
  }
  return middle;
}

std::string check_ply_name(const std::string& path) {
  std::string end = path.substr(path.size() - std::min<std::size_t>(path.size(), 4));
  return CLI::detail::to_lower(end) == ".ply" ? ""
                                              : "expected a name that ends in .ply, found " + path;
}

/// CLI11 itself would let -1 and 2^64 pass.
std::string check_seed(const std::string& text) {
  if (cloud_file::parse_count(text)) return "";
  return "expected a whole number from 0 to 2^64 - 1, found " + text;
}

}  // namespace

CLI::App* add_align_command(CLI::App& app, AlignArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "align", "Find the rigid pose that moves SOURCE onto TARGET, from any starting pose.");
  command->add_option("SOURCE", arguments.source, "Cloud to move")->type_name("FILE")->required();
  command->add_option("TARGET", arguments.target, "Cloud to move it onto")
      ->type_name("FILE")
      ->required();
  command->add_flag("--json", arguments.json, "Print one JSON object instead of text");
  command
      ->add_option("-o,--output", arguments.output,
                   "Write the moved source (all of its points) to this PLY file")
      ->check(CLI::Validator(check_ply_name, ""))
      ->type_name("FILE.ply");
  command
      ->add_option("--html", arguments.html,
                   "Write a page that shows the clouds in 3D to this file; it needs no network")
      ->type_name("FILE.html");
  command->add_option("--model", arguments.model, "Model file; default: the built-in model")
      ->type_name("FILE");
  command
      ->add_option_function<std::string>(
          "--mode",
          [&arguments](const std::string& name) {
            arguments.options.mode = name == "coarse"  ? Mode::coarse
                                     : name == "paper" ? Mode::paper
                                                       : Mode::verified;
          },
          "verified (default): the pose that explains both clouds best, out of many; paper: the "
          "coarse and the fine register; coarse: it alone")
      ->type_name("MODE")
      ->check(CLI::IsMember({"coarse", "paper", "verified"}));
  command->add_option("--threads", arguments.options.threads, "Threads; 0: as many as OpenMP says")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command
      ->add_option(
          "--max-points", arguments.options.max_points,
          "Use at most so many points of a cloud (64 to 16384); 0: as the model was trained")
      ->type_name("N")
      ->check(CLI::Range(0, 16384));
  command->add_flag("--drop-non-finite", arguments.options.drop_non_finite,
                    "Leave out points with NaN or infinite coordinates instead of refusing them");
  command->add_option("--seed", arguments.options.seed, "Seed of the choice of those points")
      ->check(CLI::Validator(check_seed, ""))
      ->type_name("N");
  command->footer(
      "Example: vnreg align scan.ply model.pcd --json -o moved.ply\n"
      "Clouds are read as PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY.\n"
      "Exit codes: 0 aligned, 2 usage, 3 input, 4 not sure, 1 anything else.");
  return command;
}

Outcome run_align(const AlignArguments& arguments) {
  const Points source = cloud_file::read_cloud(arguments.source);
  const Points target = cloud_file::read_cloud(arguments.target);
  const Model model = arguments.model.empty() ? Model::builtin() : load_model(arguments.model);
  Registrar registrar = make_registrar(model, arguments.options);
  const Result& result = registrar.align(source, target);
  if (!result.has_pose) {
    refuse_clouds(result, {arguments.source, source}, {arguments.target, target},
                  model.min_points());
  }
  if (!arguments.output.empty()) write_moved(arguments.output, source, result.T_target_source);
  if (!arguments.html.empty()) {
    const Explanation explanation = registrar.explain();
    write_html_view(arguments.html,
                    {source, target, arguments.source, arguments.target, result, &explanation,
                     model.name(), to_string(arguments.options.mode)});
  }
  const AlignReport report{result, model.name(), arguments.options.mode, middle_of(source)};
  return {result.status == Status::ok ? ExitCode::ok : ExitCode::not_sure,
          arguments.json ? to_json(report) : to_text(report)};
}

}  // namespace vnreg::cli
