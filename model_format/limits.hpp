// The numbers of SPEC.md: sizes, caps and codes that the reader compares with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace vnreg::model_format {

inline constexpr std::array<std::uint8_t, 8> magic{0x89, 'V', 'N', 'R', '\r', '\n', 0x1a, '\n'};
inline constexpr std::uint32_t major_version = 1;
inline constexpr std::uint32_t minor_version = 0;

inline constexpr std::size_t header_bytes = 64;
inline constexpr std::size_t alignment = 64;  // of the data section and of every tensor in it

/// The next multiple of the alignment; `bytes` is at most the size of a file.
constexpr std::uint64_t rounded_up(std::uint64_t bytes) noexcept {
  return (bytes + alignment - 1) / alignment * alignment;
}

inline constexpr std::uint64_t max_file_bytes = std::uint64_t{1} << 30;
inline constexpr std::uint64_t max_metadata_bytes = std::uint64_t{1} << 20;
inline constexpr std::uint64_t max_tensors = 65536;
inline constexpr std::uint32_t max_name_bytes = 128;
inline constexpr std::uint32_t max_rank = 4;

}  // namespace vnreg::model_format
