#include "model_format/utf8.hpp"

#include <cstdint>

namespace vnreg::model_format {
namespace {

struct Lead {
  std::size_t length;     // of the sequence, 0 where no sequence starts with this byte
  std::uint32_t bits;     // of the code point, held by the first byte
  std::uint32_t minimum;  // a smaller code point has a shorter form
};

Lead classify(std::uint32_t byte) noexcept {
  if (byte < 0x80) return {1, byte, 1};  // minimum 1: U+0000 would cut a C string short
  if (byte < 0xc0) return {0, 0, 0};
  if (byte < 0xe0) return {2, byte & 0x1f, 0x80};
  if (byte < 0xf0) return {3, byte & 0x0f, 0x800};
  if (byte < 0xf8) return {4, byte & 0x07, 0x10000};
  return {0, 0, 0};
}

// The length of the sequence at the start of `bytes`, 0 when it is invalid.
std::size_t sequence_length(std::span<const std::byte> bytes) noexcept {
  const Lead lead = classify(std::to_integer<std::uint32_t>(bytes[0]));
  if (lead.length == 0 || lead.length > bytes.size()) return 0;
  std::uint32_t code_point = lead.bits;
  for (const std::byte next : bytes.subspan(1, lead.length - 1)) {
    const auto value = std::to_integer<std::uint32_t>(next);
    if ((value & 0xc0) != 0x80) return 0;
    code_point = (code_point << 6) | (value & 0x3f);
  }
  const bool surrogate = code_point >= 0xd800 && code_point <= 0xdfff;
  if (code_point < lead.minimum || code_point > 0x10ffff || surrogate) return 0;
  return lead.length;
}

}  // namespace

std::optional<std::size_t> find_invalid_utf8(std::span<const std::byte> bytes) noexcept {
  std::size_t position = 0;
  while (position < bytes.size()) {
    const std::size_t length = sequence_length(bytes.subspan(position));
    if (length == 0) return position;
    position += length;
  }
  return std::nullopt;
}

}  // namespace vnreg::model_format
