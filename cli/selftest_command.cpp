#include "selftest_command.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>
#include <vector>

#include "model_format/model_file.hpp"
#include "rotation.hpp"

namespace vnreg::cli {
namespace {

namespace fs = std::filesystem;
using model_format::AlignedBytes;
using model_format::DType;
using model_format::ModelFile;
using model_format::Tensor;

// A stage may differ from torch's by the rounding of float32 sums in another order.
constexpr double max_stage_error = 1e-5;
constexpr double max_rotation_deg = 0.01;
constexpr double max_translation = 1e-4;  // network units, where a cloud has radius about 1

// ---- files ----

/// A model that ships with the program: beside the installed program, or in the source tree.
std::string shipped_model(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share" / "vnreg" / name;
  if (!error && fs::exists(installed, error)) return installed.string();
  const fs::path source_tree = fs::path(VNREG_SOURCE_MODELS) / name;
  if (fs::exists(source_tree, error)) return source_tree.string();
  throw CommandError(ExitCode::input, name + ": expected it at " + installed.string() + " or " +
                                          source_tree.string() +
                                          ", found neither; name one with --model");
}

std::string golden_beside(const std::string& model) {
  return fs::path(model).replace_extension(".golden.vnr").string();
}

std::vector<double> values_of(const Tensor& tensor) {
  const auto widen = [](const auto& values) {
    return std::vector<double>(values.begin(), values.end());
  };
  switch (tensor.dtype) {
    case DType::f32:
      return widen(tensor.f32());
    case DType::f64:
      return widen(tensor.f64());
    case DType::i32:
      break;
  }
  return widen(tensor.i32());
}

void check_golden(const ModelFile& golden, std::span<const std::byte> model) {
  if (const std::string arch = golden.get_string("arch"); arch != "golden") {
    throw Error(ErrorCode::wrong_architecture, "arch", "golden", arch);
  }
  const std::uint64_t expected = golden.get_u64("model.crc", 0, 0xFFFFFFFFU);
  if (const std::uint64_t checksum = head_checksum(model); checksum != expected) {
    throw Error(ErrorCode::corrupt_model, "model.crc",
                std::to_string(checksum) + " (the model to be tested)", std::to_string(expected));
  }
}

std::vector<std::array<double, 3>> input_cloud(const ModelFile& golden, const std::string& name) {
  const auto found = golden.tensors().find(name);
  if (found == golden.tensors().end()) {
    throw Error(ErrorCode::missing_tensor, name, "a tensor of shape (N, 3)", "none");
  }
  const Tensor& tensor = found->second;
  if (tensor.shape.size() != 2 || tensor.shape[1] != 3) {
    throw Error(ErrorCode::missing_tensor, name, "the shape (N, 3)", "another shape");
  }
  const std::vector<double> values = values_of(tensor);
  std::vector<std::array<double, 3>> points(tensor.shape[0]);
  for (std::size_t i = 0; i < values.size(); ++i) points[i / 3][i % 3] = values[i];
  return points;
}

// ---- comparison ----

/// |values - reference| / |reference|; NaN if any value is.
double normalised_error(const std::vector<double>& values, const std::vector<double>& reference) {
  double difference = 0;
  double norm = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    difference += (values[i] - reference[i]) * (values[i] - reference[i]);
    norm += reference[i] * reference[i];
  }
  if (difference == 0) return 0;
  return norm > 0 ? std::sqrt(difference / norm) : std::numeric_limits<double>::infinity();
}

struct Verdict {
  bool equal = false;
  std::string text;
};

Verdict compare_indices(const std::vector<double>& values, const std::vector<double>& reference) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < values.size(); ++i) different += values[i] != reference[i] ? 1 : 0;
  return {different == 0,
          std::to_string(different) + " of " + std::to_string(values.size()) + " indices differ"};
}

Verdict compare_poses(const std::vector<double>& values, const std::vector<double>& reference) {
  Pose a{};
  Pose b{};
  std::copy_n(values.begin(), a.size(), a.begin());
  std::copy_n(reference.begin(), b.size(), b.begin());
  const double rotation = rotation_difference_deg(a, b);
  const double translation = translation_difference(a, b);
  // Comparisons with NaN are false, so NaN fails.
  return {rotation <= max_rotation_deg && translation <= max_translation,
          "rotation " + number_text(rotation, 3) + " degrees, translation " +
              number_text(translation, 3)};
}

Verdict compare(const Stage* stage, const Tensor& tensor) {
  if (stage == nullptr) return {false, "not computed"};
  if (stage->shape != tensor.shape) return {false, "computed with another shape"};
  const std::vector<double> reference = values_of(tensor);
  if (tensor.dtype == DType::i32) return compare_indices(stage->values, reference);
  const bool is_pose =
      tensor.shape == std::vector<std::size_t>{4, 4} && tensor.name.ends_with(".T");
  if (is_pose) return compare_poses(stage->values, reference);
  const double error = normalised_error(stage->values, reference);
  return {error <= max_stage_error, "error " + number_text(error, 3)};
}

/// The stages of the golden file, in the order in which the engine computes them; those that it
/// does not compute come last.
std::vector<std::pair<const Tensor*, const Stage*>> pair_up(const ModelFile& golden,
                                                            const std::vector<Stage>& stages) {
  static constexpr std::string_view prefix = "stage.";
  std::vector<std::pair<const Tensor*, const Stage*>> pairs;
  for (const Stage& stage : stages) {
    const auto found = golden.tensors().find(std::string(prefix) + stage.name);
    if (found != golden.tensors().end()) pairs.emplace_back(&found->second, &stage);
  }
  for (const auto& named : golden.tensors()) {
    const auto is_this = [&](const auto& pair) { return pair.first == &named.second; };
    if (named.first.starts_with(prefix) && std::ranges::none_of(pairs, is_this)) {
      pairs.emplace_back(&named.second, nullptr);
    }
  }
  return pairs;
}

Outcome report(const ModelFile& golden, const std::vector<Stage>& stages,
               const std::string& files) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  const auto pairs = pair_up(golden, stages);
  std::size_t failed = 0;
  for (const auto& [tensor, stage] : pairs) {
    const Verdict verdict = compare(stage, *tensor);
    failed += verdict.equal ? 0 : 1;
    text << (verdict.equal ? "ok    " : "FAIL  ") << std::left << std::setw(32)
         << tensor->name.substr(6) << verdict.text << '\n';
  }
  if (pairs.empty()) throw Error(ErrorCode::missing_tensor, "stage.*", "one stage or more", "none");
  text << pairs.size() - failed << " of " << pairs.size() << " stages equal (" << files << "; "
       << instruction_set() << ")\n";
  return {failed == 0 ? ExitCode::ok : ExitCode::failure, text.str()};
}

Outcome replay(const std::string& model_path, const std::string& golden_path) {
  const Model model = load_model(model_path);
  const AlignedBytes model_bytes = model_format::read_file(model_path);
  try {
    const AlignedBytes bytes = model_format::read_file(golden_path);
    const ModelFile golden = ModelFile::parse(bytes.span());
    check_golden(golden, model_bytes.span());
    const auto source = input_cloud(golden, "input.source");
    const auto target = input_cloud(golden, "input.target");
    Options options;
    options.record_stages = true;
    // Every point counts: a golden run is never subsampled.
    options.max_points = static_cast<int>(
        std::clamp<std::size_t>(std::max(source.size(), target.size()), 64, 16384));
    Registrar registrar = make_registrar(model, options);
    registrar.align(source, target);
    return report(golden, registrar.stages(), model_path + ", " + golden_path);
  } catch (const Error& error) {
    throw command_error(error, golden_path);
  }
}

}  // namespace

CLI::App* add_selftest_command(CLI::App& app, SelftestArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "selftest", "Replay a recorded run and compare every stage of the computation with it.");
  command->add_option("--model", arguments.model, "Model file; default: the built-in model's")
      ->type_name("FILE");
  command
      ->add_option("--golden", arguments.golden,
                   "Golden file; default: named like the model, with .golden.vnr")
      ->type_name("FILE");
  command->footer(
      "Example: vnreg selftest --model models/vnreg.vnr --golden models/vnreg.golden.vnr\n"
      "Exit codes: 0 every stage is equal, 1 one differs, 2 usage, 3 input.");
  return command;
}

Outcome run_selftest(const SelftestArguments& arguments) {
  const std::string model = arguments.model.empty() ? shipped_model("vnreg.vnr") : arguments.model;
  return replay(model, arguments.golden.empty() ? golden_beside(model) : arguments.golden);
}

}  // namespace vnreg::cli
