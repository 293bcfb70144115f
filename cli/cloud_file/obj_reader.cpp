// Wavefront OBJ: the lines `v x y z`, with whatever follows on them (a weight, a colour) ignored.
#include "cloud_file/readers.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

/// The next word of a statement, which a backslash at the end of a line continues on the next.
std::string_view next_statement_word(LineReader& lines, std::string_view& rest) {
  std::string_view word = next_word(rest);
  while (word == "\\" && trimmed(rest).empty()) {
    const auto continuation = lines.next();
    if (!continuation) return {};
    rest = *continuation;
    word = next_word(rest);
  }
  return word;
}

}  // namespace

Points read_obj(std::string_view bytes) {
  Points points;
  LineReader lines(bytes);
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    if (next_word(rest) != "v") continue;
    std::array<double, 3>& point = points.emplace_back();
    for (double& coordinate : point) {
      const std::string_view word = next_statement_word(lines, rest);
      const std::optional<double> value = parse_number(word);
      if (!value) fail_at_line(lines.line_number(), "'v x y z' with three numbers", quoted(word));
      coordinate = *value;
    }
  }
  if (points.empty()) {
    fail("lines 'v x y z' of an OBJ file",
         "none in " + std::to_string(lines.line_number()) + " lines");
  }
  return points;
}

}  // namespace vnreg::cloud_file
