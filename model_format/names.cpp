#include <algorithm>

#include "model_format/limits.hpp"
#include "model_format/sections.hpp"

namespace vnreg::model_format {
namespace {

bool allowed(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_';
}

}  // namespace

std::string_view parse_name(ByteCursor& cursor, const std::string& what,
                            std::string_view previous) {
  const std::size_t length_byte = cursor.position();
  const auto length = cursor.number<std::uint32_t>(what + " length");
  if (length < 1 || length > max_name_bytes) {
    refuse(what + " length", length_byte, "1 to " + std::to_string(max_name_bytes),
           std::to_string(length));
  }
  const std::size_t name_byte = cursor.position();
  const auto bytes = cursor.take(length, what);
  const std::string_view name(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto bad = std::ranges::find_if_not(name, allowed);
  if (bad != name.end()) {
    const auto code = static_cast<unsigned>(static_cast<unsigned char>(*bad));
    refuse(what, name_byte + static_cast<std::size_t>(bad - name.begin()), "A-Z a-z 0-9 . _ only",
           "a byte of value " + std::to_string(code));
  }
  // Strictly ascending order is also what rules out duplicates.
  if (name <= previous) {
    refuse(what, name_byte, "a name after \"" + std::string(previous) + "\"",
           "\"" + std::string(name) + "\"");
  }
  return name;
}

}  // namespace vnreg::model_format
