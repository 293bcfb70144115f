#include "info_command.hpp"

#include <algorithm>
#include <iomanip>
#include <locale>
#include <nlohmann/json.hpp>
#include <sstream>
#include <type_traits>

#include "cloud_file/cloud_file_error.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::cli {
namespace {

using model_format::DType;
using model_format::ModelFile;
using model_format::Tensor;
using model_format::Value;
using Json = nlohmann::ordered_json;

struct Totals {
  std::size_t tensors = 0;
  std::size_t elements = 0;
  std::size_t tensor_bytes = 0;
  std::size_t file_bytes = 0;
};

Totals totals_of(const ModelFile& file, std::size_t file_bytes) {
  Totals totals;
  totals.file_bytes = file_bytes;
  for (const auto& [name, tensor] : file.tensors()) {
    ++totals.tensors;
    totals.elements += tensor.element_count();
    totals.tensor_bytes += tensor.bytes.size();
  }
  return totals;
}

const char* dtype_name(DType dtype) {
  switch (dtype) {
    case DType::f32:
      return "f32";
    case DType::f64:
      return "f64";
    case DType::i32:
      break;
  }
  return "i32";
}

std::string shape_text(const Tensor& tensor) {
  std::string text;
  for (const std::size_t extent : tensor.shape) {
    text += (text.empty() ? "" : " x ") + std::to_string(extent);
  }
  return text;
}

std::string value_text(const Value& value) {
  return std::visit(
      [](const auto& held) -> std::string {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, std::string>) {
          return cloud_file::one_line(held);
        } else if constexpr (std::is_same_v<Held, bool>) {
          return held ? "true" : "false";
        } else if constexpr (std::is_same_v<Held, double>) {
          return number_text(held, 10);
        } else {
          return std::to_string(held);
        }
      },
      value);
}

template <class Map, class Width>
std::size_t widest(const Map& entries, Width width) {
  std::size_t most = 0;
  for (const auto& entry : entries) most = std::max(most, width(entry).size());
  return most;
}

std::string to_text(const ModelFile& file, const Totals& totals) {
  const auto key = [](const auto& entry) { return entry.first; };
  const auto shape = [](const auto& entry) { return shape_text(entry.second); };
  const int key_width = static_cast<int>(widest(file.metadata(), key)) + 2;
  const int name_width = static_cast<int>(widest(file.tensors(), key)) + 2;
  const int shape_width = static_cast<int>(widest(file.tensors(), shape)) + 2;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "metadata\n";
  for (const auto& [name, value] : file.metadata()) {
    text << "  " << std::left << std::setw(key_width) << name << value_text(value) << '\n';
  }
  text << "tensors (name, type, shape, bytes)\n";
  for (const auto& [name, tensor] : file.tensors()) {
    text << "  " << std::left << std::setw(name_width) << name << dtype_name(tensor.dtype) << "  "
         << std::setw(shape_width) << shape_text(tensor) << std::right << std::setw(9)
         << tensor.bytes.size() << '\n';
  }
  text << "total: " << totals.tensors << " tensors, " << totals.elements << " numbers, "
       << totals.tensor_bytes << " bytes; file " << totals.file_bytes << " bytes\n";
  return text.str();
}

std::string to_json(const ModelFile& file, const Totals& totals) {
  Json metadata = Json::object();
  for (const auto& [name, value] : file.metadata()) {
    metadata[name] = std::visit([](const auto& held) { return Json(held); }, value);
  }
  Json tensors = Json::array();
  for (const auto& [name, tensor] : file.tensors()) {
    tensors.push_back({{"name", name},
                       {"dtype", dtype_name(tensor.dtype)},
                       {"shape", tensor.shape},
                       {"bytes", tensor.bytes.size()}});
  }
  const Json json{{"metadata", std::move(metadata)},
                  {"tensors", std::move(tensors)},
                  {"totals",
                   {{"tensors", totals.tensors},
                    {"elements", totals.elements},
                    {"tensor_bytes", totals.tensor_bytes},
                    {"file_bytes", totals.file_bytes}}}};
  return json.dump(2) + "\n";
}

}  // namespace

CLI::App* add_info_command(CLI::App& app, InfoArguments& arguments) {
  CLI::App* command = app.add_subcommand("info", "Print what a model file (.vnr) holds.");
  command->add_option("MODEL", arguments.model, "Model file")->type_name("FILE")->required();
  command->add_flag("--json", arguments.json, "Print one JSON object instead of text");
  command->footer("Example: vnreg info models/vnreg.vnr");
  return command;
}

Outcome run_info(const InfoArguments& arguments) {
  try {
    const auto bytes = model_format::read_file(arguments.model);
    const ModelFile file = ModelFile::parse(bytes.span());
    const Totals totals = totals_of(file, bytes.span().size());
    return {ExitCode::ok, arguments.json ? to_json(file, totals) : to_text(file, totals)};
  } catch (const Error& error) {
    throw command_error(error, arguments.model);
  }
}

}  // namespace vnreg::cli
