// The k largest of n values, exactly and in a fixed order.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Indices of the k = out.size() largest values, descending, equal values by lower index.
/// `scratch` holds values.size() keys; out.size() <= values.size().
void top_k(std::span<const float> values, std::span<std::uint64_t> scratch,
           std::span<std::uint32_t> out) noexcept;

}  // namespace vnreg::kernels
