// Lines, words and numbers of text files; the same in every locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace vnreg::cloud_file {

/// Walks over the lines of a file. Lines end with LF or CR LF, or with CR alone if the first line
/// does; the last line need not end. A UTF-8 byte order mark at the start is skipped.
class LineReader {
 public:
  explicit LineReader(std::string_view bytes);

  /// The next line without its end, or nothing after the last.
  std::optional<std::string_view> next();

  /// The number of the line that next() returned last, from 1.
  std::size_t line_number() const { return line_number_; }
  /// Where the next line begins, in bytes from the start of the file.
  std::size_t offset() const { return offset_; }
  /// Everything after the line that next() returned last.
  std::string_view rest() const { return bytes_.substr(offset_); }

 private:
  std::string_view bytes_;
  std::size_t offset_ = 0;
  std::size_t line_number_ = 0;
  char line_end_ = '\n';
};

/// True for space, tab, CR, vertical tab and form feed.
bool is_blank(char c);
/// `text` without blanks at either end.
std::string_view trimmed(std::string_view text);
/// Removes the first blank-separated word from `rest` and returns it; empty if there is none.
std::string_view next_word(std::string_view& rest);
/// How many blank-separated words `text` has.
std::size_t count_words(std::string_view text);

/// A decimal number with an optional sign, fraction and exponent, or nan, inf, infinity. The whole
/// text must be the number. Values beyond a double become infinity or zero, as strtod has it.
std::optional<double> parse_number(std::string_view text);
/// A whole number from 0 to 2^64 - 1, digits only.
std::optional<std::uint64_t> parse_count(std::string_view text);

}  // namespace vnreg::cloud_file
