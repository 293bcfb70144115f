// PCD, the Point Cloud Library's format. The header names the fields of a point; the body holds the
// points as rows of text, as packed rows (DATA binary), or field after field, each for all points,
// compressed (DATA binary_compressed). Binary numbers are little-endian. VIEWPOINT is not applied.
#include <algorithm>
#include <limits>

#include "cloud_file/lzf.hpp"
#include "cloud_file/readers.hpp"
#include "cloud_file/scalar_type.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

struct Field {
  std::string name;
  std::uint64_t size = 0;   // bytes of one number
  char type = 0;            // I, U or F
  std::uint64_t count = 1;  // numbers per point
};

struct Header {
  std::vector<Field> fields;
  std::optional<std::uint64_t> width;
  std::optional<std::uint64_t> height;
  std::optional<std::uint64_t> points;
  std::string data;
};

/// One coordinate: which numbers of a point hold it.
struct Axis {
  ScalarType type = ScalarType::float32;
  std::size_t word = 0;    // index among the numbers of a row of text
  std::size_t offset = 0;  // bytes from the start of a packed point
};

struct Layout {
  std::array<Axis, 3> axes;
  std::size_t point_bytes = 0;
  std::size_t point_words = 0;
  std::size_t points = 0;
};

std::uint64_t parse_whole(std::string_view word, std::string_view what, std::size_t line) {
  const std::optional<std::uint64_t> value = parse_count(word);
  if (!value) fail_at_line(line, std::string(what) + " as a whole number", quoted(word));
  return *value;
}

// ---- header ----

std::uint64_t parse_size(std::string_view word, std::size_t line) {
  if (word == "1" || word == "2" || word == "4" || word == "8") return *parse_count(word);
  fail_at_line(line, "SIZE 1, 2, 4 or 8", quoted(word));
}

char parse_type(std::string_view word, std::size_t line) {
  if (word == "I" || word == "U" || word == "F") return word[0];
  fail_at_line(line, "TYPE I, U or F", quoted(word));
}

/// Reads one word per field into the fields, in their order.
template <class Store>
void for_each_field(Header& header, std::string_view keyword, std::string_view rest,
                    std::size_t line, Store store) {
  if (header.fields.empty()) fail_at_line(line, "FIELDS before " + std::string(keyword), "none");
  if (const std::size_t words = count_words(rest); words != header.fields.size()) {
    fail_at_line(line, std::to_string(header.fields.size()) + " entries, one per field",
                 std::to_string(words));
  }
  for (Field& field : header.fields) store(field, next_word(rest));
}

void parse_fields(Header& header, std::string_view rest) {
  header.fields.clear();
  for (std::string_view name = next_word(rest); !name.empty(); name = next_word(rest)) {
    header.fields.push_back({.name = std::string(name)});
  }
}

/// Takes one line of the header. True if it was the last (DATA).
bool parse_header_line(Header& header, std::string_view text, std::size_t line) {
  std::string_view rest = text;
  const std::string_view keyword = next_word(rest);
  const auto whole = [&] { return parse_whole(trimmed(rest), keyword, line); };
  if (keyword.empty() || keyword.starts_with('#') || keyword == "VERSION" ||
      keyword == "VIEWPOINT") {
    return false;
  }
  if (keyword == "FIELDS" || keyword == "COLUMNS") {
    parse_fields(header, rest);
  } else if (keyword == "SIZE") {
    for_each_field(header, keyword, rest, line, [&](Field& field, std::string_view word) {
      field.size = parse_size(word, line);
    });
  } else if (keyword == "TYPE") {
    for_each_field(header, keyword, rest, line, [&](Field& field, std::string_view word) {
      field.type = parse_type(word, line);
    });
  } else if (keyword == "COUNT") {
    for_each_field(header, keyword, rest, line, [&](Field& field, std::string_view word) {
      field.count = parse_whole(word, keyword, line);
    });
  } else if (keyword == "WIDTH") {
    header.width = whole();
  } else if (keyword == "HEIGHT") {
    header.height = whole();
  } else if (keyword == "POINTS") {
    header.points = whole();
  } else if (keyword == "DATA") {
    header.data = std::string(trimmed(rest));
    return true;
  } else {
    fail_at_line(line, "a PCD header keyword such as FIELDS, SIZE, POINTS or DATA",
                 quoted(keyword));
  }
  return false;
}

Header parse_header(LineReader& lines) {
  Header header;
  while (const auto line = lines.next()) {
    if (parse_header_line(header, *line, lines.line_number())) return header;
  }
  fail_at_line(lines.line_number(), "the header line DATA", "the end of the file");
}

// ---- what the header says about the body ----

ScalarType scalar_type(const Field& field) {
  switch (field.type) {
    case 'I':
      return field.size == 1   ? ScalarType::int8
             : field.size == 2 ? ScalarType::int16
             : field.size == 4 ? ScalarType::int32
                               : ScalarType::int64;
    case 'U':
      return field.size == 1   ? ScalarType::uint8
             : field.size == 2 ? ScalarType::uint16
             : field.size == 4 ? ScalarType::uint32
                               : ScalarType::uint64;
    default:
      break;
  }
  if (field.size == 4) return ScalarType::float32;
  if (field.size == 8) return ScalarType::float64;
  fail("SIZE 4 or 8 for the field '" + field.name + "' of TYPE F", std::to_string(field.size));
}

/// a * b, or an error that names `what` where 64 bits cannot hold it.
std::uint64_t checked_product(std::uint64_t a, std::uint64_t b, std::string_view what) {
  if (a != 0 && b > std::numeric_limits<std::uint64_t>::max() / a) {
    fail(std::string(what) + " within 64 bits", std::to_string(a) + " x " + std::to_string(b));
  }
  return a * b;
}

std::uint64_t point_count(const Header& header) {
  if (!header.width && !header.points) fail("WIDTH or POINTS in the header", "neither");
  if (!header.width) return *header.points;
  const std::uint64_t area =
      checked_product(*header.width, header.height.value_or(1), "WIDTH x HEIGHT");
  if (header.points && *header.points != area) {
    fail("POINTS equal to WIDTH x HEIGHT = " + std::to_string(area),
         std::to_string(*header.points));
  }
  return area;
}

Axis find_axis(const Header& header, char name) {
  std::optional<Axis> axis;
  std::size_t word = 0;
  std::size_t offset = 0;
  for (const Field& field : header.fields) {
    if (field.name == std::string_view(&name, 1)) {
      if (axis || field.count != 1) {
        fail(std::string("one field '") + name + "' with COUNT 1", axis ? "two" : "another COUNT");
      }
      axis = Axis{scalar_type(field), word, offset};
    }
    word += field.count;
    offset += field.size * field.count;
  }
  if (!axis) fail(std::string("a field '") + name + "' in FIELDS", "none");
  return *axis;
}

Layout layout_of(const Header& header) {
  // No field may exceed 2^32 bytes and no header 2^16 fields, so the sums below cannot overflow.
  static constexpr std::uint64_t most_bytes = std::uint64_t{1} << 32U;
  static constexpr std::size_t most_fields = std::size_t{1} << 16U;
  if (header.fields.size() > most_fields) fail("at most 65536 fields", "more");
  Layout layout;
  for (const Field& field : header.fields) {
    if (field.size == 0) fail("a line SIZE in the header", "none");
    if (field.type == 0) fail("a line TYPE in the header", "none");
    if (field.count > most_bytes / field.size) {
      fail("a COUNT of the field " + quoted(field.name) + " below 4 GiB",
           std::to_string(field.count));
    }
    layout.point_bytes += field.size * field.count;
    layout.point_words += field.count;
  }
  for (std::size_t i = 0; i < 3; ++i) layout.axes[i] = find_axis(header, "xyz"[i]);
  layout.points = point_count(header);
  return layout;
}

// ---- body ----

void check_available(std::uint64_t need, std::size_t have, std::size_t offset,
                     std::string_view what) {
  if (need > have) {
    fail_at_byte(offset, std::to_string(need) + " bytes of " + std::string(what),
                 std::to_string(have) + " bytes up to the end of the file");
  }
}

Points read_rows_of_text(LineReader& lines, const Layout& layout) {
  // Every number takes a digit and a separator, but for the last of the file.
  if (layout.points > (lines.rest().size() + 1) / (2 * layout.point_words)) {
    fail_at_line(lines.line_number() + 1, std::to_string(layout.points) + " points",
                 "a file that ends after " + std::to_string(lines.rest().size()) + " more bytes");
  }
  Points points;
  points.reserve(layout.points);
  std::vector<std::string_view> words;
  while (points.size() < layout.points) {
    const auto line = lines.next();
    if (!line) {
      fail_at_line(lines.line_number(), std::to_string(layout.points) + " points",
                   "the end of the file after " + std::to_string(points.size()));
    }
    std::string_view rest = trimmed(*line);
    if (rest.empty()) continue;
    words.clear();
    for (auto word = next_word(rest); !word.empty(); word = next_word(rest)) words.push_back(word);
    if (words.size() != layout.point_words) {
      fail_at_line(lines.line_number(), std::to_string(layout.point_words) + " numbers",
                   std::to_string(words.size()));
    }
    std::array<double, 3>& point = points.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view word = words[layout.axes[i].word];
      const std::optional<double> value = parse_number(word);
      if (!value) fail_at_line(lines.line_number(), "a number", quoted(word));
      point[i] = *value;
    }
  }
  return points;
}

Points read_packed(std::string_view body, std::size_t offset, const Layout& layout) {
  check_available(checked_product(layout.points, layout.point_bytes, "POINTS x bytes of a point"),
                  body.size(), offset, "points");
  Points points(layout.points);
  const char* row = body.data();
  for (std::array<double, 3>& point : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Axis& axis = layout.axes[i];
      point[i] = load_scalar(row + axis.offset, axis.type, std::endian::little);
    }
    row += layout.point_bytes;
  }
  return points;
}

/// The body of binary_compressed, decompressed: every field's numbers for all points, in turn.
std::string decompress(std::string_view body, std::size_t offset, const Layout& layout) {
  static constexpr std::size_t sizes_bytes = 8;  // two uint32: compressed, uncompressed
  check_available(sizes_bytes, body.size(), offset, "compressed and uncompressed size");
  const auto size_at = [&](std::size_t at) {
    return static_cast<std::uint64_t>(
        load_scalar(body.data() + at, ScalarType::uint32, std::endian::little));
  };
  const std::uint64_t compressed = size_at(0);
  const std::uint64_t uncompressed = size_at(4);
  const std::uint64_t need =
      checked_product(layout.points, layout.point_bytes, "POINTS x bytes of a point");
  if (uncompressed != need) {
    fail_at_byte(offset + 4, "an uncompressed size of " + std::to_string(need) + " bytes",
                 std::to_string(uncompressed));
  }
  check_available(compressed, body.size() - sizes_bytes, offset + sizes_bytes, "compressed points");
  std::optional<std::string> columns =
      lzf_decompress(body.substr(sizes_bytes, compressed), uncompressed);
  if (!columns) {
    fail_at_byte(offset + sizes_bytes,
                 "LZF data that expands to " + std::to_string(uncompressed) + " bytes",
                 "a broken stream of " + std::to_string(compressed) + " bytes");
  }
  return std::move(*columns);
}

Points read_columns(std::string_view columns, const Layout& layout) {
  Points points(layout.points);
  for (std::size_t i = 0; i < 3; ++i) {
    const Axis& axis = layout.axes[i];
    const char* value = columns.data() + axis.offset * layout.points;
    for (std::array<double, 3>& point : points) {
      point[i] = load_scalar(value, axis.type, std::endian::little);
      value += size_of(axis.type);
    }
  }
  return points;
}

}  // namespace

Points read_pcd(std::string_view bytes) {
  LineReader lines(bytes);
  const Header header = parse_header(lines);
  const std::size_t data_line = lines.line_number();
  const Layout layout = layout_of(header);
  if (header.data == "ascii") return read_rows_of_text(lines, layout);
  if (header.data == "binary") return read_packed(lines.rest(), lines.offset(), layout);
  if (header.data == "binary_compressed") {
    return read_columns(decompress(lines.rest(), lines.offset(), layout), layout);
  }
  fail_at_line(data_line, "DATA ascii, binary or binary_compressed", quoted(header.data));
}

}  // namespace vnreg::cloud_file
