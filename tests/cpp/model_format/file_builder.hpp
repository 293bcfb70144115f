// Builds model files byte by byte from SPEC.md, right or wrong on purpose. It shares no code with
// the reader: the checksum is the bitwise definition, and every field can be overridden while the
// checksums stay right, so that a test reaches the structural check behind them.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vnreg::model_format::test {

using Bytes = std::string;

inline std::uint32_t bitwise_crc32c(std::string_view bytes) {
  std::uint32_t state = 0xffffffff;
  for (const char c : bytes) {
    state ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) state = (state >> 1) ^ (0x82f63b78u & (0u - (state & 1u)));
  }
  return ~state;
}

inline Bytes little_endian(std::uint64_t value, int bytes) {
  Bytes text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xff);
  return text;
}
inline Bytes u8(std::uint64_t value) { return little_endian(value, 1); }
inline Bytes u32(std::uint64_t value) { return little_endian(value, 4); }
inline Bytes u64(std::uint64_t value) { return little_endian(value, 8); }
inline Bytes f32(float value) { return u32(std::bit_cast<std::uint32_t>(value)); }
inline Bytes f64(double value) { return u64(std::bit_cast<std::uint64_t>(value)); }

inline Bytes padded(Bytes bytes) {
  bytes.resize((bytes.size() + 63) / 64 * 64, '\0');
  return bytes;
}

/// A string with its length in front: a key, a name or a text value.
inline Bytes counted(std::string_view text) { return u32(text.size()) + Bytes(text); }

inline Bytes entry(std::string_view key, std::uint32_t type, const Bytes& value) {
  return counted(key) + u32(type) + value;
}
inline Bytes u64_entry(std::string_view key, std::uint64_t v) { return entry(key, 1, u64(v)); }
inline Bytes f64_entry(std::string_view key, double v) { return entry(key, 2, f64(v)); }
inline Bytes bool_entry(std::string_view key, std::uint8_t v) { return entry(key, 3, u8(v)); }
inline Bytes string_entry(std::string_view key, std::string_view v) {
  return entry(key, 4, counted(v));
}

inline Bytes table_entry(std::string_view name, std::uint32_t dtype,
                         const std::vector<std::uint64_t>& shape, std::uint64_t offset) {
  Bytes bytes = counted(name) + u32(dtype) + u32(shape.size());
  for (const std::uint64_t extent : shape) bytes += u64(extent);
  return bytes + u64(offset);
}

inline Bytes f32_data(std::initializer_list<float> values) {
  Bytes bytes;
  for (const float value : values) bytes += f32(value);
  return padded(bytes);
}

/// The parts of a file. What is not set follows from the other parts.
struct Draft {
  Bytes metadata;
  Bytes table;
  std::uint64_t tensor_count = 0;
  Bytes data;

  Bytes magic = Bytes("\x89VNR\r\n\x1a\n", 8);
  std::uint32_t major = 1;
  std::uint32_t minor = 0;
  std::optional<Bytes> table_padding;
  std::optional<std::uint64_t> file_size, metadata_bytes, data_offset, data_bytes;
  std::uint32_t data_checksum_error = 0;  // added to the right value
  std::uint32_t head_checksum_error = 0;

  Bytes build() const {
    Bytes rest = metadata + table;
    rest = table_padding ? rest + *table_padding : padded(rest);
    const Bytes head =
        magic + u32(major) + u32(minor) + u64(file_size.value_or(64 + rest.size() + data.size())) +
        u64(metadata_bytes.value_or(metadata.size())) + u64(tensor_count) +
        u64(data_offset.value_or(64 + rest.size())) + u64(data_bytes.value_or(data.size())) +
        u32(bitwise_crc32c(data) + data_checksum_error);
    return head + u32(bitwise_crc32c(head + rest) + head_checksum_error) + rest + data;
  }
};

/// Every type of value, a tensor of every dtype, padding in every place that can have it.
inline Draft small_draft() {
  Draft draft;
  draft.metadata = string_entry("arch", "paper") + f64_entry("input.rms_radius", 0.5) +
                   u64_entry("neighbours", 20) + bool_entry("relu.shared_direction", 1);
  draft.table = table_entry("a.weight", 1, {2, 3}, 0) + table_entry("b", 3, {1, 1, 1, 5}, 64) +
                table_entry("c", 2, {9}, 128);
  draft.tensor_count = 3;
  Bytes b;
  for (int i = -2; i < 3; ++i) b += u32(static_cast<std::uint32_t>(i));
  Bytes c;
  for (int i = 0; i < 9; ++i) c += f64(0.1 * i);
  draft.data = f32_data({1, -2, 3.5F, 0, -0.0F, 1e-40F}) + padded(b) + padded(c);
  return draft;
}

}  // namespace vnreg::model_format::test
