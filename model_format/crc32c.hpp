// CRC32C (Castagnoli), the checksum of the model file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace vnreg::model_format {

/// The CRC32C of `bytes`. To checksum several pieces as if they were one, pass the value of the
/// pieces before as `previous`.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t previous = 0) noexcept;

}  // namespace vnreg::model_format
