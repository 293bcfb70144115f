#include "engine_options.hpp"

#include "cloud_file/text_scan.hpp"
#include "command.hpp"

namespace vnreg::cli {
namespace {

/// CLI11 itself would let -1 and 2^64 pass.
std::string check_seed(const std::string& text) {
  if (cloud_file::parse_count(text)) return "";
  return "expected a whole number from 0 to 2^64 - 1, found " + text;
}

Mode mode_named(const std::string& name) {
  if (name == "coarse") return Mode::coarse;
  return name == "paper" ? Mode::paper : Mode::verified;
}

}  // namespace

Model EngineArguments::load() const { return model.empty() ? Model::builtin() : load_model(model); }

void add_engine_options(CLI::App& command, EngineArguments& arguments) {
  Options& options = arguments.options;
  command.add_option("--model", arguments.model, "Model file; default: the built-in model")
      ->type_name("FILE");
  command
      .add_option_function<std::string>(
          "--mode", [&options](const std::string& name) { options.mode = mode_named(name); },
          "verified (default): the pose that explains both clouds best, out of many; paper: the "
          "coarse and the fine register; coarse: it alone")
      ->type_name("MODE")
      ->check(CLI::IsMember({"coarse", "paper", "verified"}));
  command
      .add_option("--budget-ms", options.time_budget_ms,
                  "Stop looking for a better pose after so many milliseconds a pair; 0: no limit")
      ->type_name("MS")
      ->check(CLI::Range(0.0, 1e9));
  command
      .add_option("--max-points", options.max_points,
                  "Use at most so many points of a cloud (64 to 16384); 0: as the model was "
                  "trained")
      ->type_name("N")
      ->check(CLI::Range(0, 16384));
  command.add_flag("--drop-non-finite", options.drop_non_finite,
                   "Leave out points with NaN or infinite coordinates instead of refusing them");
  command.add_option("--seed", options.seed, "Seed of the choice of those points")
      ->check(CLI::Validator(check_seed, ""))
      ->type_name("N");
}

void add_threads_option(CLI::App& command, int& threads, const std::string& meaning) {
  command.add_option("--threads", threads, meaning)->type_name("N")->check(CLI::Range(0, 1024));
}

}  // namespace vnreg::cli
