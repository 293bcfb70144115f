// The weights that are compiled into the library.
#pragma once

#include <cstddef>
#include <span>

namespace vnreg::detail {

/// The bytes of models/vnreg.vnr; empty when the library was built without that file.
std::span<const std::byte> builtin_model_bytes() noexcept;

}  // namespace vnreg::detail
