// Geomview OFF: a keyword, the counts of vertices, faces and edges, then one vertex per line.
// Normals, colours and texture coordinates (prefixes N, C, ST) follow x y z on the line and are
// skipped. The keyword may be missing, and the counts may stand on its line, even without a space:
// many files of ModelNet40 begin with, say, `OFF490 518 0`.
#include "cloud_file/readers.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The length of the keyword at the start of `word`, [ST][C][N][4][n]OFF; 0 if there is none.
std::size_t keyword_length(std::string_view word) {
  std::size_t length = 0;
  for (const std::string_view prefix : {"ST", "C", "N", "4", "n"}) {
    if (word.substr(length).starts_with(prefix)) length += prefix.size();
  }
  return word.substr(length).starts_with("OFF") ? length + 3 : 0;
}

/// The next line that has more than blanks and a comment, without either.
std::optional<std::string_view> next_content(LineReader& lines) {
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(line->substr(0, line->find('#')));
    if (!content.empty()) return content;
  }
  return std::nullopt;
}

/// Removes the keyword from the first line; refuses the variants whose vertices are not x y z text.
std::string_view without_keyword(std::string_view content, std::size_t line) {
  std::string_view rest = content;
  const std::string_view word = next_word(rest);
  if (!is_off_keyword(word)) return content;
  const std::size_t length = keyword_length(word);
  const std::string_view keyword = word.substr(0, length);
  if (keyword.find_first_of("4n") != std::string_view::npos) {
    fail_at_line(line, "OFF with vertices x y z", quoted(keyword) + ", which has other dimensions");
  }
  const std::string_view after = trimmed(content.substr(length));
  if (after.starts_with("BINARY")) fail_at_line(line, "OFF as text", "'BINARY'");
  return after;
}

}  // namespace

bool is_off_keyword(std::string_view word) {
  const std::size_t length = keyword_length(word);
  return length > 0 && (length == word.size() || is_digit(word[length]));
}

Points read_off(std::string_view bytes) {
  LineReader lines(bytes);
  std::optional<std::string_view> content = next_content(lines);
  if (!content) fail("an OFF file", "no line with content");
  std::string_view counts = without_keyword(*content, lines.line_number());
  if (counts.empty()) counts = next_content(lines).value_or("");
  const std::string_view word = next_word(counts);
  const std::optional<std::uint64_t> count = parse_count(word);
  if (!count) fail_at_line(lines.line_number(), "the number of vertices", quoted(word));
  // The shortest vertex is "0 0 0" and a line end, but for the last of the file.
  if (*count > (lines.rest().size() + 1) / 6) {
    fail_at_line(lines.line_number(), std::to_string(*count) + " vertices",
                 "a file that ends after " + std::to_string(lines.rest().size()) + " more bytes");
  }
  Points points;
  points.reserve(*count);
  while (points.size() < *count) {
    std::optional<std::string_view> row = next_content(lines);
    if (!row) {
      fail_at_line(lines.line_number(), std::to_string(*count) + " vertices",
                   "the end of the file after " + std::to_string(points.size()));
    }
    std::array<double, 3>& point = points.emplace_back();
    for (double& coordinate : point) {
      const std::string_view number = next_word(*row);
      const std::optional<double> value = parse_number(number);
      if (!value) fail_at_line(lines.line_number(), "a vertex 'x y z'", quoted(number));
      coordinate = *value;
    }
  }
  return points;
}

}  // namespace vnreg::cloud_file
