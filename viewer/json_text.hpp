// JSON as the viewer's page takes it: text that is safe inside a <script> of an HTML file, too.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace vnreg::viewer {

/// A quoted string. What is not UTF-8 becomes U+FFFD; <, > and & are written as escapes.
std::string json_string(std::string_view text);
/// The shortest text that reads back as the same number; null for NaN and infinities.
std::string json_number(double value);
/// [a, b, ...]
std::string json_numbers(std::span<const double> values);
/// Base64 in quotes.
std::string json_bytes(std::span<const std::byte> bytes);

/// Writes {"key": value, ...}; the values are JSON already.
class JsonObject {
 public:
  JsonObject& add(std::string_view key, std::string_view json);
  std::string text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

/// Writes [value, ...]; the values are JSON already.
class JsonArray {
 public:
  JsonArray& add(std::string_view json);
  std::string text() const { return "[" + items_ + "]"; }

 private:
  std::string items_;
};

}  // namespace vnreg::viewer
