#include <catch2/catch.hpp>
#include <clocale>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cloud_file/text_scan.hpp"

using namespace vnreg::cloud_file;

namespace {

std::vector<std::string> lines_of(std::string_view bytes) {
  std::vector<std::string> lines;
  LineReader reader(bytes);
  while (const auto line = reader.next()) lines.emplace_back(*line);
  return lines;
}

}  // namespace

TEST_CASE("lines end with LF, CR LF or CR, and the last need not end", "[text_scan]") {
  using Lines = std::vector<std::string>;
  CHECK(lines_of("").empty());
  CHECK(lines_of("\n") == Lines{""});
  CHECK(lines_of("a\nb\n") == Lines{"a", "b"});
  CHECK(lines_of("a\nb") == Lines{"a", "b"});
  CHECK(lines_of("a\r\nb\r\n") == Lines{"a", "b"});
  CHECK(lines_of("a\rb\r\rc") == Lines{"a", "b", "", "c"});
  CHECK(lines_of("a\r") == Lines{"a"});
  CHECK(lines_of("a\nb\r\n\nc\r") == Lines{"a", "b", "", "c"});
  CHECK(lines_of("\xEF\xBB\xBFx y z\n") == Lines{"x y z"});
}

TEST_CASE("a CR-only header leaves an LF of the body alone", "[text_scan]") {
  LineReader reader("head\rend\r\nbinary");
  reader.next();
  reader.next();
  CHECK(reader.line_number() == 2);
  CHECK(reader.offset() == 9);
  CHECK(reader.rest() == "\nbinary");
}

TEST_CASE("words are separated by runs of blanks", "[text_scan]") {
  std::string_view rest = " \t one\ttwo\v three \r";
  CHECK(count_words(rest) == 3);
  CHECK(next_word(rest) == "one");
  CHECK(next_word(rest) == "two");
  CHECK(next_word(rest) == "three");
  CHECK(next_word(rest).empty());
  CHECK(trimmed(" \t a b \r") == "a b");
  CHECK(trimmed(" \t ").empty());
}

TEST_CASE("numbers are read whole, in any notation of C", "[text_scan]") {
  CHECK(parse_number("0") == 0.0);
  CHECK(parse_number("+1.5") == 1.5);
  CHECK(parse_number("-.5") == -0.5);
  CHECK(parse_number("5.") == 5.0);
  CHECK(parse_number("1e-3") == 1e-3);
  CHECK(parse_number("1E+3") == 1e3);
  CHECK(parse_number("0.1") == 0.1);
  CHECK(parse_number("123456789.123456789") == 123456789.123456789);
  CHECK(parse_number("inf") == std::numeric_limits<double>::infinity());
  CHECK(parse_number("-Infinity") == -std::numeric_limits<double>::infinity());
  CHECK(std::isnan(parse_number("nan").value()));
  CHECK(std::isnan(parse_number("-NaN").value()));
}

TEST_CASE("numbers beyond a double become infinity or zero", "[text_scan]") {
  CHECK(parse_number("1e999") == std::numeric_limits<double>::infinity());
  CHECK(parse_number("-1e999") == -std::numeric_limits<double>::infinity());
  CHECK(parse_number("1e-999") == 0.0);
  CHECK(parse_number("4.9e-324") == std::numeric_limits<double>::denorm_min());
}

TEST_CASE("what is not a number is refused", "[text_scan]") {
  for (const char* text : {"", "+", "-", "abc", "1a", "1 2", "1,5", "0x10", "++1", "+-1", "-+1",
                           "1e", "--1", ".", "e5", "1.2.3"}) {
    INFO(text);
    CHECK_FALSE(parse_number(text).has_value());
  }
}

TEST_CASE("counts are digits only and fit 64 bits", "[text_scan]") {
  CHECK(parse_count("0") == 0U);
  CHECK(parse_count("18446744073709551615") == std::numeric_limits<std::uint64_t>::max());
  for (const char* text : {"", "-1", "+1", "18446744073709551616", "1e18", "1.0", " 1", "1 "}) {
    INFO(text);
    CHECK_FALSE(parse_count(text).has_value());
  }
}

TEST_CASE("numbers do not depend on the locale", "[text_scan]") {
  // Without the locale installed setlocale changes nothing, and the check holds trivially.
  std::setlocale(LC_ALL, "de_DE.UTF-8");
  CHECK(parse_number("1.5") == 1.5);
  CHECK(parse_number("1e-400") == 0.0);
  std::setlocale(LC_ALL, "C");
}
