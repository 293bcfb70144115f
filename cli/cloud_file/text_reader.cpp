// Rows of text (XYZ, TXT, CSV): one point per line.
//
// - Blank lines and lines that begin with # or // are skipped.
// - The first line of the rest may be a header: a line without any number. Where it names columns
// x,
//   y and z (case does not matter) those are read; otherwise the first three are.
// - Columns are separated by the first of semicolon, comma and tab that makes three columns or more
//   of the first row; otherwise by runs of blanks. Double quotes round a column are removed.
// - Columns after those needed are ignored, and need not be numbers.
#include <algorithm>

#include "cloud_file/readers.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

using Columns = std::vector<std::string_view>;

constexpr char blanks = ' ';

std::string_view unquoted(std::string_view column) {
  if (column.size() >= 2 && column.starts_with('"') && column.ends_with('"')) {
    column = column.substr(1, column.size() - 2);
  }
  return trimmed(column);
}

/// Where the column that begins at `begin` ends: at the delimiter, unless that is inside quotes.
std::size_t column_end(std::string_view line, std::size_t begin, char delimiter) {
  const std::size_t first = line.find_first_not_of(' ', begin);
  std::size_t search_from = begin;
  if (first != std::string_view::npos && line[first] == '"') {
    const std::size_t closing = line.find('"', first + 1);
    if (closing != std::string_view::npos) search_from = closing;
  }
  return std::min(line.find(delimiter, search_from), line.size());
}

void split(std::string_view line, char delimiter, Columns& columns) {
  columns.clear();
  if (delimiter == blanks) {
    for (auto word = next_word(line); !word.empty(); word = next_word(line)) {
      columns.push_back(unquoted(word));
    }
    return;
  }
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = column_end(line, begin, delimiter);
    columns.push_back(unquoted(trimmed(line.substr(begin, end - begin))));
    begin = end + 1;
  }
}

char guess_delimiter(std::string_view line) {
  Columns columns;
  for (const char delimiter : {';', ',', '\t'}) {
    split(line, delimiter, columns);
    if (columns.size() >= 3) return delimiter;
  }
  return blanks;
}

bool is_row_of_numbers(const Columns& columns) {
  return columns.size() >= 3 && std::all_of(columns.begin(), columns.begin() + 3, [](auto column) {
           return parse_number(column).has_value();
         });
}

/// A slip in a first row of numbers (2.O, 1,5) must not make it a header that is skipped in
/// silence.
bool is_header(const Columns& columns) {
  return std::ranges::none_of(columns, [](std::string_view column) {
    const bool begins_so = column.find_first_of("+-.0123456789") == 0;
    return begins_so || parse_number(column).has_value();
  });
}

/// The next line that is neither blank nor a comment.
std::optional<std::string_view> next_content(LineReader& lines) {
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(*line);
    if (!content.empty() && !content.starts_with('#') && !content.starts_with("//")) return *line;
  }
  return std::nullopt;
}

bool names_axis(std::string_view column, char axis) {
  return column.size() == 1 && (column[0] == axis || column[0] == axis - 'a' + 'A');
}

/// Which columns hold x, y, z: those that the header names so, otherwise the first three.
std::array<std::size_t, 3> find_axes(const Columns& header) {
  std::array<std::size_t, 3> axes{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto named = std::ranges::find_if(
        header, [&](std::string_view column) { return names_axis(column, "xyz"[axis]); });
    if (named == header.end()) return {0, 1, 2};
    axes[axis] = static_cast<std::size_t>(named - header.begin());
  }
  return axes;
}

class RowParser {
 public:
  /// `first_row` and `header` (may be empty) tell how the columns are laid out.
  RowParser(std::string_view first_row, std::string_view header)
      : delimiter_(guess_delimiter(first_row)) {
    split(header, delimiter_, columns_);
    axes_ = find_axes(columns_);
  }

  std::array<double, 3> parse(std::string_view row, std::size_t line) {
    split(row, delimiter_, columns_);
    const std::size_t need = 1 + *std::ranges::max_element(axes_);
    if (columns_.size() < need) {
      fail_at_line(line, std::to_string(need) + " columns or more",
                   std::to_string(columns_.size()));
    }
    std::array<double, 3> point{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view column = columns_[axes_[axis]];
      const std::optional<double> value = parse_number(column);
      if (!value) {
        fail_at_line(line, "a number in column " + std::to_string(axes_[axis] + 1), quoted(column));
      }
      point[axis] = *value;
    }
    return point;
  }

 private:
  char delimiter_;
  std::array<std::size_t, 3> axes_{0, 1, 2};
  Columns columns_;
};

Columns first_columns(std::string_view line) {
  Columns columns;
  split(line, guess_delimiter(line), columns);
  return columns;
}

}  // namespace

bool starts_with_row_of_numbers(std::string_view bytes) {
  LineReader lines(bytes);
  const std::optional<std::string_view> line = next_content(lines);
  return line && is_row_of_numbers(first_columns(*line));
}

Points read_text(std::string_view bytes) {
  LineReader lines(bytes);
  std::string_view header;
  std::optional<std::string_view> row = next_content(lines);
  if (row && is_header(first_columns(*row))) {
    header = *row;
    row = next_content(lines);
  }
  if (!row) fail("rows of three numbers or more", "none");
  RowParser parser(*row, header);
  Points points;
  for (; row; row = next_content(lines)) points.push_back(parser.parse(*row, lines.line_number()));
  return points;
}

}  // namespace vnreg::cloud_file
