#include "command.hpp"

#include <iomanip>
#include <locale>
#include <sstream>

#include "cloud_file/cloud_file_error.hpp"

namespace vnreg::cli {
namespace {

ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_option:
      return ExitCode::usage;
    case ErrorCode::unsupported_cpu:
      return ExitCode::failure;
    case ErrorCode::file_unreadable:
    case ErrorCode::not_a_model:
    case ErrorCode::unsupported_version:
    case ErrorCode::corrupt_model:
    case ErrorCode::wrong_architecture:
    case ErrorCode::missing_tensor:
    case ErrorCode::invalid_points:
      break;
  }
  return ExitCode::input;
}

}  // namespace

CommandError command_error(const Error& error, const std::string& path) {
  // The field of an unreadable file is its name.
  const bool field_is_file = error.code() == ErrorCode::file_unreadable && !path.empty();
  const std::string file = path.empty() ? "" : path + ": ";
  const std::string field = field_is_file ? "" : error.field() + ": ";
  return {exit_code(error.code()),
          file + field + "expected " + error.expected() + ", found " + error.got()};
}

Model load_model(const std::string& path) {
  try {
    return Model::load(path);
  } catch (const Error& error) {
    throw command_error(error, path);
  }
}

Registrar make_registrar(const Model& model, const Options& options) {
  try {
    return Registrar(model, options);
  } catch (const Error& error) {
    throw command_error(error, "");
  }
}

std::uint64_t head_checksum(std::span<const std::byte> file) {
  std::uint64_t checksum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    checksum |= std::to_integer<std::uint64_t>(file[60 + i]) << (8 * i);
  }
  return checksum;
}

std::string number_text(double value, int digits) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::setprecision(digits) << value;
  return stream.str();
}

}  // namespace vnreg::cli
