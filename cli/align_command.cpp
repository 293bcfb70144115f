#include "align_command.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>

#include "align_many.hpp"
#include "align_report.hpp"
#include "cloud_file/ply_writer.hpp"
#include "html_view.hpp"
#include "input.hpp"
#include "no_pose.hpp"
#include "rotation.hpp"
#include "source_list.hpp"

namespace vnreg::cli {
namespace {

using cloud_file::Points;

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

/// CLI11 has no last positional after several others.
class AlignFormatter : public CLI::Formatter {
 public:
  std::string make_usage(const CLI::App*, std::string) const override {
    return "Usage: vnreg align [OPTIONS] SOURCE... TARGET\n";
  }
};

[[noreturn]] void refuse_clouds(const Result& result, const NamedCloud& source,
                                const NamedCloud& target, int min_points) {
  const bool in_time = result.status != Status::timed_out;
  throw CommandError(in_time ? ExitCode::input : ExitCode::not_sure,
                     why_no_pose(result, source, target, min_points));
}

/// The clouds of the command line, taken apart.
struct Clouds {
  std::vector<std::string> sources;
  std::string target;
};

Clouds clouds_of(const AlignArguments& arguments) {
  const auto last = std::prev(arguments.clouds.end());
  return {{arguments.clouds.begin(), last}, *last};
}

Outcome align_one(const AlignArguments& arguments, const std::string& source_path,
                  const std::string& target_path) {
  const Points source = read_input_cloud(source_path, arguments.format);
  const Points target = read_input_cloud(target_path, arguments.format);
  const Model model = arguments.engine.load();
  Registrar registrar = make_registrar(model, arguments.engine.options);
  const Result& result = registrar.align(source, target);
  if (!result.has_pose) {
    refuse_clouds(result, {input_name(source_path), source}, {input_name(target_path), target},
                  model.min_points());
  }
  if (!arguments.output.empty()) write_moved(arguments.output, source, result.T_target_source);
  if (!arguments.html.empty()) {
    const Explanation explanation = registrar.explain();
    write_html_view(arguments.html, {source, target, source_path, target_path, result, &explanation,
                                     model.name(), to_string(arguments.engine.options.mode)});
  }
  const AlignReport report{result, model.name(), arguments.engine.options.mode, middle_of(source)};
  return {result.status == Status::ok ? ExitCode::ok : ExitCode::not_sure,
          arguments.json ? to_json(report) : to_text(report)};
}

void refuse_usage(bool wrong, const std::string& expected, const std::string& found) {
  if (wrong) throw CommandError(ExitCode::usage, "expected " + expected + ", found " + found);
}

void check_usage(const AlignArguments& arguments, bool many) {
  const auto inputs = std::ranges::count(arguments.clouds, "-");
  refuse_usage(inputs > 1, "standard input (-) for one cloud", "it for several");
  refuse_usage(many && inputs > 0 && arguments.clouds.back() != "-", "files as several sources",
               "standard input (-) among them");
  refuse_usage(many && !arguments.output.empty(), "one source with --output",
               "several, a folder or a pattern");
  refuse_usage(many && !arguments.html.empty(), "one source with --html",
               "several, a folder or a pattern");
}

}  // namespace

CLI::App* add_align_command(CLI::App& app, AlignArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "align", "Find the rigid pose that moves SOURCE onto TARGET, from any starting pose.");
  command->formatter(std::make_shared<AlignFormatter>());
  // CLI11 would give several sources all that follows: the last one is taken off them later.
  command
      ->add_option("SOURCE...TARGET", arguments.clouds,
                   "The cloud to move, then the one to move it onto; -: standard input. Several "
                   "sources, a folder or a pattern such as 'scans/*.ply': each onto the target")
      ->type_name("FILE")
      ->expected(-2)
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
  add_engine_options(*command, arguments.engine);
  add_threads_option(*command, arguments.engine.options.threads,
                     "Threads; 0 (default): as many as OpenMP says");
  command
      ->add_option_function<std::string>(
          "--format",
          [&arguments](const std::string& name) {
            arguments.format = cloud_file::format_of_extension(name);
          },
          "Format of standard input; default: by its content")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"ply", "pcd", "obj", "off", "xyz", "txt", "csv", "npy"}));
  command->add_flag("--quiet", arguments.quiet, "No progress");
  command->footer(
      "Example: vnreg align scan.ply model.pcd --json -o moved.ply\n"
      "Clouds are read as PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY.\n"
      "Exit codes: 0 aligned, 2 usage, 3 input, 4 not sure, 1 anything else.");
  return command;
}

Outcome run_align(const AlignArguments& arguments) {
  const auto [sources, target] = clouds_of(arguments);
  const bool many = is_many(sources);
  check_usage(arguments, many);
  if (!many) return align_one(arguments, sources.front(), target);
  return align_many(arguments, list_sources(sources), target);
}

}  // namespace vnreg::cli
