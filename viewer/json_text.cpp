#include "viewer/json_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "model_format/utf8.hpp"

namespace vnreg::viewer {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD

std::string valid_utf8(std::string text) {
  while (const auto at = model_format::find_invalid_utf8(std::as_bytes(std::span(text)))) {
    text.replace(*at, 1, replacement);
  }
  return text;
}

bool needs_escape(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\' || c == '<' || c == '>' ||
         c == '&' || c == '\x7f';
}

void append_escape(char c, std::string& text) {
  constexpr std::string_view digits = "0123456789abcdef";
  const auto code = static_cast<unsigned char>(c);
  text += "\\u00";
  text += digits[code / 16];
  text += digits[code % 16];
}

}  // namespace

std::string json_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : valid_utf8(std::string(text))) {
    if (needs_escape(c)) {
      append_escape(c, quoted);
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string json_numbers(std::span<const double> values) {
  JsonArray array;
  for (const double value : values) array.add(json_number(value));
  return array.text();
}

std::string json_bytes(std::span<const std::byte> bytes) {
  constexpr std::string_view letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "\"";
  text.reserve(bytes.size() / 3 * 4 + 8);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? letters[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text + '"';
}

JsonObject& JsonObject::add(std::string_view key, std::string_view json) {
  if (!members_.empty()) members_ += ", ";
  members_.append(json_string(key)).append(": ").append(json);
  return *this;
}

JsonArray& JsonArray::add(std::string_view json) {
  if (!items_.empty()) items_ += ", ";
  items_ += json;
  return *this;
}

}  // namespace vnreg::viewer
