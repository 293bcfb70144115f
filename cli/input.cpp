#include "input.hpp"

#include <cstdio>

namespace vnreg::cli {
namespace {

constexpr std::string_view standard_input = "-";

}  // namespace

std::string input_name(const std::string& path) {
  return path == standard_input ? "standard input" : path;
}

std::string read_input(const std::string& path) {
  return path == standard_input ? cloud_file::read_bytes(stdin) : cloud_file::read_bytes(path);
}

cloud_file::Points read_input_cloud(const std::string& path,
                                    std::optional<cloud_file::Format> format) {
  if (path != standard_input) return cloud_file::read_cloud(path);
  try {
    const std::string bytes = read_input(path);
    return format ? cloud_file::parse_cloud_as(*format, bytes) : cloud_file::parse_cloud(bytes, "");
  } catch (const cloud_file::CloudFileError& error) {
    throw cloud_file::CloudFileError(input_name(path) + ": " + error.what());
  }
}

}  // namespace vnreg::cli
