// NumPy .npy, versions 1 to 3: magic, version, the length of the header, the header (a Python dict
// literal with descr, fortran_order and shape), then the numbers.
#include <limits>

#include "cloud_file/readers.hpp"
#include "cloud_file/scalar_type.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

struct NumberFormat {
  ScalarType type = ScalarType::float64;
  std::endian order = std::endian::little;
};

struct Header {
  std::optional<NumberFormat> format;
  std::optional<bool> fortran_order;
  std::optional<std::vector<std::uint64_t>> shape;
};

NumberFormat parse_descr(std::string_view descr) {
  static constexpr std::pair<std::string_view, ScalarType> types[] = {
      {"f4", ScalarType::float32}, {"f8", ScalarType::float64}, {"i1", ScalarType::int8},
      {"i2", ScalarType::int16},   {"i4", ScalarType::int32},   {"i8", ScalarType::int64},
      {"u1", ScalarType::uint8},   {"u2", ScalarType::uint16},  {"u4", ScalarType::uint32},
      {"u8", ScalarType::uint64},
  };
  if (!descr.empty() && std::string_view("<>|=").find(descr[0]) != std::string_view::npos) {
    for (const auto& [name, type] : types) {
      if (descr.substr(1) == name) {
        return {type, descr[0] == '>' ? std::endian::big : std::endian::little};
      }
    }
  }
  fail("the dtype float32, float64 or a whole number of 1, 2, 4 or 8 bytes", quoted(descr));
}

/// Reads the few Python literals that a header is made of.
class LiteralReader {
 public:
  LiteralReader(std::string_view text, std::size_t offset) : text_(text), offset_(offset) {}

  bool try_take(char c) {
    skip_blanks();
    if (position_ == text_.size() || text_[position_] != c) return false;
    ++position_;
    return true;
  }

  void take(char c) {
    if (!try_take(c)) refuse(std::string{'\'', c, '\''});
  }

  std::string_view string() {
    for (const char quote : {'\'', '"'}) {
      if (!try_take(quote)) continue;
      const std::size_t end = text_.find(quote, position_);
      if (end == std::string_view::npos) refuse("a closing quote");
      const std::string_view value = text_.substr(position_, end - position_);
      position_ = end + 1;
      return value;
    }
    refuse("a string (arrays with named fields are not points)");
  }

  bool boolean() {
    for (const bool value : {false, true}) {
      const std::string_view word = value ? "True" : "False";
      skip_blanks();
      if (!text_.substr(position_).starts_with(word)) continue;
      position_ += word.size();
      return value;
    }
    refuse("True or False");
  }

  std::vector<std::uint64_t> tuple() {
    std::vector<std::uint64_t> values;
    take('(');
    while (!try_take(')')) {
      values.push_back(whole_number());
      if (!try_take(',')) {
        take(')');
        break;
      }
    }
    return values;
  }

  bool at_end() {
    skip_blanks();
    return position_ == text_.size();
  }

  [[noreturn]] void refuse(std::string_view expected) const {
    fail_at_byte(offset_ + position_, expected, quoted(text_.substr(position_)));
  }

 private:
  void skip_blanks() {
    while (position_ < text_.size() && (is_blank(text_[position_]) || text_[position_] == '\n')) {
      ++position_;
    }
  }

  std::uint64_t whole_number() {
    skip_blanks();
    const std::size_t end =
        std::min(text_.find_first_not_of("0123456789", position_), text_.size());
    const auto value = parse_count(text_.substr(position_, end - position_));
    if (!value) refuse("a whole number");
    position_ = end;
    try_take('L');  // Python 2 wrote long integers so
    return *value;
  }

  std::string_view text_;
  std::size_t offset_;  // of the text in the file, for messages
  std::size_t position_ = 0;
};

Header parse_header(std::string_view text, std::size_t offset) {
  Header header;
  LiteralReader reader(text, offset);
  reader.take('{');
  while (!reader.try_take('}')) {
    const std::string_view key = reader.string();
    reader.take(':');
    if (key == "descr") {
      header.format = parse_descr(reader.string());
    } else if (key == "fortran_order") {
      header.fortran_order = reader.boolean();
    } else if (key == "shape") {
      header.shape = reader.tuple();
    } else {
      reader.refuse("the keys descr, fortran_order and shape, not " + quoted(key) +
                    "; their value");
    }
    if (!reader.try_take(',')) {
      reader.take('}');
      break;
    }
  }
  if (!reader.at_end()) reader.refuse("the end of the header");
  if (!header.format || !header.fortran_order || !header.shape) {
    fail_at_byte(offset, "descr, fortran_order and shape", quoted(text));
  }
  return header;
}

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  std::string text = "(";
  for (const std::uint64_t extent : shape) {
    if (text.size() > 1) text += ", ";
    text += std::to_string(extent);
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

void check_shape(const std::vector<std::uint64_t>& shape) {
  const bool is_matrix = shape.size() == 2;
  if (is_matrix && shape[0] == 3 && shape[1] > 3) {
    fail("the shape (N, 3)", shape_text(shape) + ": transpose it, one point per row");
  }
  if (!is_matrix || shape[1] < 3) fail("the shape (N, 3 or more)", shape_text(shape));
}

Points read_matrix(std::string_view body, std::size_t offset, const Header& header) {
  const auto [type, order] = *header.format;
  const std::uint64_t rows = (*header.shape)[0];
  const std::uint64_t columns = (*header.shape)[1];
  const std::size_t size = size_of(type);
  if (rows == 0) return {};  // of any width: no product of it below may wrap
  const std::uint64_t available = body.size() / size;
  if (columns > available || rows > available / columns) {
    fail_at_byte(offset,
                 std::string("an array of shape ") + shape_text(*header.shape) + ", " +
                     std::to_string(size) + " bytes per number",
                 std::to_string(body.size()) + " bytes up to the end of the file");
  }
  Points points(rows);
  const std::size_t row_step = *header.fortran_order ? size : size * columns;
  const std::size_t column_step = *header.fortran_order ? size * rows : size;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points[row][axis] =
          load_scalar(body.data() + row * row_step + axis * column_step, type, order);
    }
  }
  return points;
}

}  // namespace

Points read_npy(std::string_view bytes) {
  static constexpr std::string_view magic = "\x93NUMPY";
  if (!bytes.starts_with(magic))
    fail_at_byte(0, "'\\x93NUMPY'", quoted(bytes.substr(0, magic.size())));
  if (bytes.size() < 12)
    fail_at_byte(magic.size(), "a version and a header", "the end of the file");
  const auto version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3) {
    fail_at_byte(6, "version 1, 2 or 3", std::to_string(version));
  }
  const ScalarType length_type = version == 1 ? ScalarType::uint16 : ScalarType::uint32;
  const auto length =
      static_cast<std::size_t>(load_scalar(bytes.data() + 8, length_type, std::endian::little));
  const std::size_t begin = 8 + size_of(length_type);
  if (length > bytes.size() - begin) {
    fail_at_byte(begin, "a header of " + std::to_string(length) + " bytes",
                 std::to_string(bytes.size() - begin) + " bytes up to the end of the file");
  }
  const Header header = parse_header(bytes.substr(begin, length), begin);
  check_shape(*header.shape);
  return read_matrix(bytes.substr(begin + length), begin + length, header);
}

}  // namespace vnreg::cloud_file
