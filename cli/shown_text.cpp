#include "shown_text.hpp"

#include <span>

#include "cloud_file/cloud_file_error.hpp"
#include "model_format/utf8.hpp"

namespace vnreg::cli {
namespace {

std::string hexadecimal(unsigned char byte) {
  static constexpr std::string_view digits = "0123456789abcdef";
  return {'\\', 'x', digits[byte >> 4U], digits[byte & 15U]};
}

}  // namespace

std::string shown_text(std::string_view bytes) {
  std::string text;
  while (const auto bad = model_format::find_invalid_utf8(std::as_bytes(std::span(bytes)))) {
    text += bytes.substr(0, *bad);
    text += hexadecimal(static_cast<unsigned char>(bytes[*bad]));
    bytes.remove_prefix(*bad + 1);
  }
  text += bytes;
  return cloud_file::one_line(text);
}

}  // namespace vnreg::cli
