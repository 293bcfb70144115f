#include "model_format/utf8.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <string>

namespace vnreg::model_format::test {
namespace {

std::optional<std::size_t> find_invalid(const std::string& text) {
  return find_invalid_utf8(std::as_bytes(std::span(text)));
}

std::string encode(std::uint32_t c) {
  const auto tail = [c](int shift) { return static_cast<char>(0x80 | ((c >> shift) & 0x3f)); };
  if (c < 0x80) return {static_cast<char>(c)};
  if (c < 0x800) return {static_cast<char>(0xc0 | (c >> 6)), tail(0)};
  if (c < 0x10000) return {static_cast<char>(0xe0 | (c >> 12)), tail(6), tail(0)};
  return {static_cast<char>(0xf0 | (c >> 18)), tail(12), tail(6), tail(0)};
}

struct Range {
  unsigned low, high;
  bool has(unsigned char byte) const { return byte >= low && byte <= high; }
};

// Well-formed byte sequences, row by row as in table 3-7 of the Unicode standard, less U+0000.
struct Row {
  std::size_t length;
  std::array<Range, 4> bytes;
};
constexpr Range tail{0x80, 0xbf};
constexpr std::array<Row, 9> rows{{{1, {{{0x01, 0x7f}, {}, {}, {}}}},
                                   {2, {{{0xc2, 0xdf}, tail, {}, {}}}},
                                   {3, {{{0xe0, 0xe0}, {0xa0, 0xbf}, tail, {}}}},
                                   {3, {{{0xe1, 0xec}, tail, tail, {}}}},
                                   {3, {{{0xed, 0xed}, {0x80, 0x9f}, tail, {}}}},
                                   {3, {{{0xee, 0xef}, tail, tail, {}}}},
                                   {4, {{{0xf0, 0xf0}, {0x90, 0xbf}, tail, tail}}},
                                   {4, {{{0xf1, 0xf3}, tail, tail, tail}}},
                                   {4, {{{0xf4, 0xf4}, {0x80, 0x8f}, tail, tail}}}}};

std::size_t table_length(const std::string& text, std::size_t start) {
  for (const Row& row : rows) {
    bool fits = start + row.length <= text.size();
    for (std::size_t i = 0; fits && i < row.length; ++i) {
      fits = row.bytes[i].has(static_cast<unsigned char>(text[start + i]));
    }
    if (fits) return row.length;
  }
  return 0;
}

std::optional<std::size_t> find_invalid_by_table(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = table_length(text, i);
    if (length == 0) return i;
    i += length;
  }
  return std::nullopt;
}

TEST_CASE("utf8: every code point but U+0000 and the surrogates is accepted") {
  std::size_t accepted = 0;
  for (std::uint32_t c = 0; c <= 0x110000; ++c) {
    const bool fine = c > 0 && c < 0x110000 && !(c >= 0xd800 && c <= 0xdfff);
    const bool found = !find_invalid(encode(c)).has_value();
    if (found != fine) FAIL("code point " << c);
    accepted += found ? 1 : 0;
  }
  CHECK(accepted == 0x10ffff - 2048);
}

TEST_CASE("utf8: all mixes of boundary bytes agree with the Unicode table") {
  const std::string bytes(
      "\x00\x01\x7f\x80\x8f\x90\x9f\xa0\xbf\xc0\xc1\xc2\xdf\xe0\xe1\xec\xed\xee\xef\xf0\xf1\xf3"
      "\xf4\xf5\xf8\xff",
      26);
  for (const char a : bytes) {
    for (const char b : bytes) {
      for (const char c : bytes) {
        for (const char d : bytes) {
          const std::string text{a, b, c, d};
          if (find_invalid(text) != find_invalid_by_table(text)) {
            FAIL("bytes " << Catch::StringMaker<std::string>::convert(text));
          }
        }
      }
    }
  }
}

TEST_CASE("utf8: the position is that of the sequence, and a cut sequence is invalid") {
  CHECK_FALSE(find_invalid("").has_value());
  CHECK(find_invalid("a\xc3\xa9z") == std::nullopt);
  CHECK(find_invalid("a\xc3\xa9\xff") == 3u);
  CHECK(find_invalid("abc\xf0\x9f\x98") == 3u);
  CHECK(find_invalid(std::string("ab\0c", 4)) == 2u);
}

}  // namespace
}  // namespace vnreg::model_format::test
