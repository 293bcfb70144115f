#include "cloud_file/cloud_file_error.hpp"

namespace vnreg::cloud_file {

namespace {

template <class Keep>
std::string escaped(std::string_view text, Keep keep) {
  static constexpr std::string_view digits = "0123456789abcdef";
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (keep(byte)) {
      result += c;
    } else {
      result += "\\x";
      result += digits[byte >> 4U];
      result += digits[byte & 15U];
    }
  }
  return result;
}

}  // namespace

std::string one_line(std::string_view text) {
  return escaped(text, [](unsigned char byte) { return byte >= 0x20 && byte != 0x7f; });
}

std::string quoted(std::string_view text) {
  static constexpr std::size_t longest = 40;
  if (text.empty()) return "nothing";
  const auto is_printable = [](unsigned char byte) { return byte >= 0x20 && byte < 0x7f; };
  std::string result = "'";
  result += escaped(text.substr(0, longest), is_printable);
  result += text.size() > longest ? "...'" : "'";
  return result;
}

void fail(std::string_view expected, std::string_view found) {
  throw CloudFileError("expected " + std::string(expected) + ", found " + std::string(found));
}

void fail_at_line(std::size_t line, std::string_view expected, std::string_view found) {
  throw CloudFileError("line " + std::to_string(line) + ": expected " + std::string(expected) +
                       ", found " + std::string(found));
}

void fail_at_byte(std::size_t offset, std::string_view expected, std::string_view found) {
  throw CloudFileError("byte " + std::to_string(offset) + ": expected " + std::string(expected) +
                       ", found " + std::string(found));
}

}  // namespace vnreg::cloud_file
