// Whether bytes are text as SPEC.md allows it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace vnreg::model_format {

/// The position of the first byte sequence that is not well-formed UTF-8 (shortest form, no
/// surrogates, at most U+10FFFF) or that is U+0000; nothing when all of `bytes` is fine.
std::optional<std::size_t> find_invalid_utf8(std::span<const std::byte> bytes) noexcept;

}  // namespace vnreg::model_format
