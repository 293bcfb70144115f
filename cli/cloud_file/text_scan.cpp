#include "cloud_file/text_scan.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace vnreg::cloud_file {
namespace {

// The slow path of parse_number: the value overflows or underflows a double. The wider exponent of
// long double tells which; what even it cannot hold is refused.
std::optional<double> parse_extreme(std::string_view text) {
  long double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (std::fabs(value) > static_cast<long double>(std::numeric_limits<double>::max())) {
    return std::copysign(std::numeric_limits<double>::infinity(), value < 0 ? -1.0 : 1.0);
  }
  return static_cast<double>(value);
}

}  // namespace

LineReader::LineReader(std::string_view bytes) : bytes_(bytes) {
  if (bytes_.starts_with("\xEF\xBB\xBF")) offset_ = 3;
  const std::size_t first = bytes_.find_first_of("\r\n", offset_);
  if (first != std::string_view::npos && bytes_[first] == '\r' &&
      (first + 1 == bytes_.size() || bytes_[first + 1] != '\n')) {
    line_end_ = '\r';
  }
}

std::optional<std::string_view> LineReader::next() {
  if (offset_ >= bytes_.size()) return std::nullopt;
  const std::size_t end = std::min(bytes_.find(line_end_, offset_), bytes_.size());
  std::string_view line = bytes_.substr(offset_, end - offset_);
  offset_ = std::min(end + 1, bytes_.size());
  ++line_number_;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view next_word(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

std::size_t count_words(std::string_view text) {
  std::size_t count = 0;
  while (!next_word(text).empty()) ++count;
  return count;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) return parse_extreme(text);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> parse_count(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace vnreg::cloud_file
