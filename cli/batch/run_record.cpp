#include "batch/run_record.hpp"

#include <nlohmann/json.hpp>

#include "cloud_file/cloud_file.hpp"
#include "cloud_file/whole_file.hpp"
#include "command.hpp"
#include "model_format/model_file.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

using Json = nlohmann::ordered_json;
// A file may hold many names; this finds one without looking at all of them.
using AnyJson = nlohmann::json;

/// Tells model files apart; of the built-in model its name and the program's version do.
Json checksum_of(const std::string& model) {
  if (model.empty()) return nullptr;
  const auto bytes = model_format::read_file(model);
  return head_checksum(bytes.span());
}

/// As messages show it: the file may be of any size, and anybody's.
std::string shown(const AnyJson& value) {
  static constexpr std::size_t longest = 40;
  static constexpr bool as_ascii = true;
  const std::string text = value.dump(-1, ' ', as_ascii);
  return text.size() > longest ? text.substr(0, longest) + "..." : text;
}

[[noreturn]] void refuse(const std::string& path, const std::string& expected,
                         const std::string& found) {
  throw CommandError(ExitCode::usage, path + ": expected " + expected + ", found " + found +
                                          "; name another output, or begin anew with --overwrite");
}

}  // namespace

std::string run_record(const EngineArguments& arguments, const Model& model) {
  const Options& options = arguments.options;
  const Json json{{"version", version()},
                  {"model", shown_text(model.name())},
                  {"model_checksum", checksum_of(arguments.model)},
                  {"mode", to_string(options.mode)},
                  {"budget_ms", options.time_budget_ms},
                  {"max_points", options.max_points},
                  {"drop_non_finite", options.drop_non_finite},
                  {"seed", options.seed}};
  return json.dump() + '\n';
}

std::string record_path(const std::string& path) { return path + ".run.json"; }

void write_record(const std::string& path, const std::string& record) {
  try {
    cloud_file::write_whole_file(path, {record});
  } catch (const cloud_file::CloudFileError& error) {
    throw CommandError(ExitCode::failure, error.what());
  }
}

void check_record(const std::string& path, const std::string& record) {
  AnyJson found;
  try {
    found = AnyJson::parse(cloud_file::read_bytes(path));
  } catch (const std::exception&) {
    refuse(path, "the settings of the run that wrote the rows", "none");
  }
  const Json expected = Json::parse(record);
  for (const auto& [key, json] : expected.items()) {
    const AnyJson value(json);
    const AnyJson other = found.is_object() && found.contains(key) ? found[key] : AnyJson(nullptr);
    if (other != value) refuse(path, key + ' ' + shown(value), shown(other));
  }
}

}  // namespace vnreg::cli
