#include "cloud_file/cloud_file_error.hpp"

#include <algorithm>

namespace vnreg::cloud_file {

namespace {

void add_hexadecimal(char c, std::string& text) {
  static constexpr std::string_view digits = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(c);
  text += "\\x";
  text += digits[byte >> 4U];
  text += digits[byte & 15U];
}

/// How many bytes the control character takes that the text begins with; 0 for another character.
/// Terminals obey U+0080 to U+009F, too, which are 0xc2 and the number.
std::size_t control_length(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  if (first != 0xc2) return first < 0x20 || first == 0x7f ? 1 : 0;
  return text.size() > 1 && (static_cast<unsigned char>(text[1]) & 0xe0U) == 0x80 ? 2 : 0;
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const std::size_t control = control_length(text);
    if (control == 0) line += text[0];
    for (const char c : text.substr(0, control)) add_hexadecimal(c, line);
    text.remove_prefix(std::max<std::size_t>(control, 1));
  }
  return line;
}

std::string quoted(std::string_view text) {
  static constexpr std::size_t longest = 40;
  if (text.empty()) return "nothing";
  std::string result = "'";
  for (const char c : text.substr(0, longest)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f) {
      result += c;
    } else {
      add_hexadecimal(c, result);
    }
  }
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
