// Decoder of the LZF compression that PCD's binary_compressed uses.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace vnreg::cloud_file {

/// A stream of n bytes never expands to more than n times this: 3 bytes repeat at most 264.
inline constexpr std::size_t lzf_max_expansion = 88;

/// The `size` bytes that `compressed` stands for; nothing if the stream is broken or stands for
/// another number of bytes. Allocates `size` bytes, which must not exceed
/// compressed.size() * lzf_max_expansion.
std::optional<std::string> lzf_decompress(std::string_view compressed, std::size_t size);

}  // namespace vnreg::cloud_file
