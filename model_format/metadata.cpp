#include <cmath>

#include "model_format/limits.hpp"
#include "model_format/sections.hpp"
#include "model_format/utf8.hpp"

namespace vnreg::model_format {
namespace {

enum class ValueType : std::uint32_t { u64 = 1, f64 = 2, boolean = 3, string = 4 };

double parse_f64(ByteCursor& cursor, const std::string& what) {
  const std::size_t byte = cursor.position();
  const auto value = cursor.number<double>(what);
  if (!std::isfinite(value)) {
    refuse(what, byte, "a finite number", std::isnan(value) ? "NaN" : "infinity");
  }
  return value;
}

bool parse_bool(ByteCursor& cursor, const std::string& what) {
  const std::size_t byte = cursor.position();
  const auto value = cursor.number<std::uint8_t>(what);
  if (value > 1) refuse(what, byte, "0 or 1", std::to_string(value));
  return value == 1;
}

std::string parse_string(ByteCursor& cursor, const std::string& what) {
  const auto length = cursor.number<std::uint32_t>(what + " length");
  const std::size_t byte = cursor.position();
  const auto bytes = cursor.take(length, what);
  if (const auto bad = find_invalid_utf8(bytes)) {
    refuse(what, byte + *bad, "UTF-8 without U+0000",
           "a sequence that starts with " + std::to_string(std::to_integer<int>(bytes[*bad])));
  }
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

ValueType parse_type(ByteCursor& cursor, const std::string& what) {
  const std::size_t byte = cursor.position();
  const auto code = cursor.number<std::uint32_t>(what);
  if (code < 1 || code > 4) {
    refuse(what, byte, "1 (u64), 2 (f64), 3 (bool) or 4 (string)", std::to_string(code));
  }
  return static_cast<ValueType>(code);
}

Value parse_value(ByteCursor& cursor, const std::string& what) {
  switch (parse_type(cursor, what + " type")) {
    case ValueType::u64:
      return cursor.number<std::uint64_t>(what);
    case ValueType::f64:
      return parse_f64(cursor, what);
    case ValueType::boolean:
      return parse_bool(cursor, what);
    case ValueType::string:
      break;
  }
  return parse_string(cursor, what);
}

}  // namespace

ModelFile::Metadata parse_metadata(std::span<const std::byte> file, const Header& header) {
  ModelFile::Metadata metadata;
  std::string_view previous;
  ByteCursor cursor(file, header_bytes, header_bytes + header.metadata_bytes);
  while (!cursor.at_end()) {
    previous = parse_name(cursor, "metadata key " + std::to_string(metadata.size()), previous);
    const std::string key(previous);
    metadata.emplace_hint(metadata.end(), key, parse_value(cursor, "metadata \"" + key + "\""));
  }
  return metadata;
}

}  // namespace vnreg::model_format
