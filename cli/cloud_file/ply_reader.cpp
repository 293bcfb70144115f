// Stanford PLY 1.0. The header names elements (vertex, face, ...) with typed properties; the body
// holds them row by row, as text or as packed binary. Only x, y, z of `vertex` are kept, but every
// row of every element is walked over, so that a file cut short is noticed.
#include <algorithm>
#include <limits>
#include <utility>

#include "cloud_file/readers.hpp"
#include "cloud_file/scalar_type.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

enum class Encoding { ascii, little_endian, big_endian };

struct Property {
  std::string name;
  ScalarType type = ScalarType::float32;
  std::optional<ScalarType>
      count_type;  // present in lists: the type of the length before the items

  /// The bytes that one row takes at least: the value, or the length of an empty list.
  std::size_t min_bytes() const { return size_of(count_type.value_or(type)); }
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool has_lists() const {
    return std::ranges::any_of(properties,
                               [](const Property& p) { return p.count_type.has_value(); });
  }
  std::size_t min_row_bytes() const {
    std::size_t bytes = 0;
    for (const Property& property : properties) bytes += property.min_bytes();
    return bytes;
  }
};

struct Header {
  std::optional<Encoding> encoding;
  std::vector<Element> elements;
};

std::string rows_of(const Element& element) {
  return std::to_string(element.count) + " rows of element " + quoted(element.name);
}

std::optional<ScalarType> scalar_type(std::string_view word) {
  static constexpr std::pair<std::string_view, ScalarType> names[] = {
      {"char", ScalarType::int8},      {"int8", ScalarType::int8},
      {"uchar", ScalarType::uint8},    {"uint8", ScalarType::uint8},
      {"short", ScalarType::int16},    {"int16", ScalarType::int16},
      {"ushort", ScalarType::uint16},  {"uint16", ScalarType::uint16},
      {"int", ScalarType::int32},      {"int32", ScalarType::int32},
      {"uint", ScalarType::uint32},    {"uint32", ScalarType::uint32},
      {"int64", ScalarType::int64},    {"uint64", ScalarType::uint64},
      {"float", ScalarType::float32},  {"float32", ScalarType::float32},
      {"double", ScalarType::float64}, {"float64", ScalarType::float64},
  };
  for (const auto& [name, type] : names) {
    if (name == word) return type;
  }
  return std::nullopt;
}

// ---- header ----

Encoding parse_encoding(std::string_view rest, std::size_t line) {
  const std::string_view word = next_word(rest);
  if (word == "ascii") return Encoding::ascii;
  if (word == "binary_little_endian") return Encoding::little_endian;
  if (word == "binary_big_endian") return Encoding::big_endian;
  fail_at_line(line, "the format ascii, binary_little_endian or binary_big_endian", quoted(word));
}

Element parse_element(std::string_view rest, std::size_t line) {
  const std::string_view name = next_word(rest);
  const std::string_view count = next_word(rest);
  const std::optional<std::uint64_t> rows = parse_count(count);
  if (!rows) fail_at_line(line, "'element NAME COUNT' with a whole number", quoted(count));
  return {std::string(name), *rows, {}};
}

ScalarType parse_type(std::string_view word, std::size_t line) {
  const std::optional<ScalarType> type = scalar_type(word);
  if (!type)
    fail_at_line(line, "a property type such as float, double, uchar or int", quoted(word));
  return *type;
}

Property parse_property(std::string_view rest, std::size_t line) {
  Property property;
  std::string_view word = next_word(rest);
  if (word == "list") {
    property.count_type = parse_type(next_word(rest), line);
    if (!is_integer(*property.count_type)) {
      fail_at_line(line, "a whole-number type for the length of a list", "a floating-point type");
    }
    word = next_word(rest);
  }
  property.type = parse_type(word, line);
  property.name = std::string(next_word(rest));
  if (property.name.empty()) fail_at_line(line, "the name of a property", "nothing");
  return property;
}

Header parse_header(LineReader& lines) {
  if (const auto first = lines.next(); !first || trimmed(*first) != "ply") {
    fail_at_line(1, "'ply'", quoted(first.value_or("")));
  }
  Header header;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    const std::string_view keyword = next_word(rest);
    const std::size_t number = lines.line_number();
    if (keyword == "format") {
      header.encoding = parse_encoding(rest, number);
    } else if (keyword == "element") {
      header.elements.push_back(parse_element(rest, number));
    } else if (keyword == "property") {
      if (header.elements.empty()) fail_at_line(number, "'element' before 'property'", "none");
      header.elements.back().properties.push_back(parse_property(rest, number));
    } else if (keyword == "end_header") {
      if (!header.encoding) fail_at_line(number, "a 'format' line in the header", "none");
      return header;
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      fail_at_line(number, "format, element, property, comment or end_header", quoted(keyword));
    }
  }
  fail_at_line(lines.line_number(), "'end_header'", "the end of the file");
}

// ---- which properties are the coordinates ----

constexpr std::size_t no_axis = 3;

/// For every property of `vertex`, the axis (0, 1, 2) that it holds, or no_axis.
std::vector<std::size_t> find_axes(const Element& vertex) {
  std::vector<std::size_t> axes(vertex.properties.size(), no_axis);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    std::size_t found = 0;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (vertex.properties[i].name != name || vertex.properties[i].count_type) continue;
      axes[i] = axis;
      ++found;
    }
    if (found != 1) {
      fail("one number '" + name + "' in element 'vertex' of the header", std::to_string(found));
    }
  }
  return axes;
}

const Element& find_vertex(const Header& header) {
  const auto is_vertex = [](const Element& element) { return element.name == "vertex"; };
  const auto found = std::ranges::count_if(header.elements, is_vertex);
  if (found != 1) fail("one element 'vertex' in the header", std::to_string(found));
  return *std::ranges::find_if(header.elements, is_vertex);
}

// ---- body ----

/// Where the values of one element go: nowhere, or the coordinates to `points`.
struct Sink {
  Points* points = nullptr;
  std::vector<std::size_t> axes;  // per property; empty without points

  bool keeps(std::size_t property) const { return points && axes[property] != no_axis; }
};

/// Walks over binary rows; never reads beyond the end of the file.
class BinaryBody {
 public:
  BinaryBody(std::string_view bytes, std::size_t offset, std::endian order)
      : bytes_(bytes), offset_(offset), order_(order) {}

  void read(const Element& element, const Sink& sink) {
    const std::size_t row_bytes = element.min_row_bytes();
    if (row_bytes == 0) return;
    if (element.count > remaining() / row_bytes) {
      fail_at_byte(offset_,
                   rows_of(element) + ", " + std::to_string(row_bytes) + " bytes or more each",
                   std::to_string(remaining()) + " bytes up to the end of the file");
    }
    const auto count = static_cast<std::size_t>(element.count);
    if (sink.points) sink.points->reserve(count);
    if (!sink.points && !element.has_lists()) {
      offset_ += count * row_bytes;
      return;
    }
    for (std::size_t row = 0; row < count; ++row) read_row(element, sink);
  }

 private:
  std::size_t remaining() const { return bytes_.size() - offset_; }

  const char* take(std::size_t count, const Element& element) {
    if (count > remaining()) {
      fail_at_byte(offset_, rows_of(element), "the end of the file in the middle of a row");
    }
    const char* begin = bytes_.data() + offset_;
    offset_ += count;
    return begin;
  }

  void read_row(const Element& element, const Sink& sink) {
    std::array<double, 3> point{};
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const char* value = take(property.min_bytes(), element);
      if (property.count_type) {
        skip_items(load_scalar(value, *property.count_type, order_), property, element);
      } else if (sink.keeps(i)) {
        point[sink.axes[i]] = load_scalar(value, property.type, order_);
      }
    }
    if (sink.points) sink.points->push_back(point);
  }

  void skip_items(double length, const Property& property, const Element& element) {
    const std::size_t most = remaining() / size_of(property.type);
    if (length < 0 || length > static_cast<double>(most)) {
      fail_at_byte(
          offset_, "a list " + quoted(property.name) + " that fits the file",
          "a length of " + std::to_string(static_cast<std::int64_t>(std::min(length, 9e18))));
    }
    take(static_cast<std::size_t>(length) * size_of(property.type), element);
  }

  std::string_view bytes_;
  std::size_t offset_;
  std::endian order_;
};

/// Walks over rows of text: one row per line, blank lines skipped.
class TextBody {
 public:
  explicit TextBody(LineReader& lines) : lines_(lines) {}

  void read(const Element& element, const Sink& sink) {
    if (element.properties.empty()) return;
    // Every value takes a digit and a separator, but for the last of the file.
    const std::size_t values = element.properties.size();
    const std::size_t most = (lines_.rest().size() + 1) / (2 * values);
    if (element.count > most) {
      fail_at_line(
          lines_.line_number() + 1, rows_of(element),
          "a file that ends after " + std::to_string(lines_.rest().size()) + " more bytes");
    }
    if (sink.points) sink.points->reserve(static_cast<std::size_t>(element.count));
    for (std::uint64_t row = 0; row < element.count; ++row)
      read_row(next_row(element), element, sink);
  }

 private:
  std::string_view next_row(const Element& element) {
    while (const auto line = lines_.next()) {
      if (!trimmed(*line).empty()) return *line;
    }
    fail_at_line(lines_.line_number(), rows_of(element), "the end of the file");
  }

  void read_row(std::string_view row, const Element& element, const Sink& sink) {
    std::string_view rest = row;
    std::array<double, 3> point{};
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const std::string_view word = take(rest, element);
      if (element.properties[i].count_type) {
        skip_items(word, rest, element);
      } else if (sink.keeps(i)) {
        point[sink.axes[i]] = number(word, element.properties[i]);
      }
    }
    // MeshLab writes surplus values on rows of faces; on a row of a point they would be a riddle.
    if (sink.points && !trimmed(rest).empty()) {
      fail_at_line(lines_.line_number(), "the end of a row of element " + quoted(element.name),
                   quoted(trimmed(rest)));
    }
    if (sink.points) sink.points->push_back(point);
  }

  std::string_view take(std::string_view& rest, const Element& element) {
    const std::string_view word = next_word(rest);
    if (word.empty()) {
      fail_at_line(lines_.line_number(), "more values in a row of element " + quoted(element.name),
                   "the end of the line");
    }
    return word;
  }

  void skip_items(std::string_view word, std::string_view& rest, const Element& element) {
    const std::optional<std::uint64_t> length = parse_count(word);
    if (!length) fail_at_line(lines_.line_number(), "the length of a list", quoted(word));
    for (std::uint64_t i = 0; i < *length; ++i) take(rest, element);
  }

  double number(std::string_view word, const Property& property) const {
    const std::optional<double> value = parse_number(word);
    if (!value)
      fail_at_line(lines_.line_number(), "a number for '" + property.name + "'", quoted(word));
    return *value;
  }

  LineReader& lines_;
};

template <class Body>
Points read_body(Body body, const Header& header) {
  Points points;
  const Element& vertex = find_vertex(header);
  const Sink vertex_sink{&points, find_axes(vertex)};
  const Sink nowhere;
  for (const Element& element : header.elements) {
    body.read(element, &element == &vertex ? vertex_sink : nowhere);
  }
  return points;
}

}  // namespace

Points read_ply(std::string_view bytes) {
  LineReader lines(bytes);
  const Header header = parse_header(lines);
  if (*header.encoding == Encoding::ascii) return read_body(TextBody(lines), header);
  const bool little = *header.encoding == Encoding::little_endian;
  return read_body(
      BinaryBody(bytes, lines.offset(), little ? std::endian::little : std::endian::big), header);
}

}  // namespace vnreg::cloud_file
