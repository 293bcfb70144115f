#include "kernels/top_k.hpp"

#include <algorithm>
#include <bit>

namespace vnreg::kernels {
namespace {

/// Integers that ascend as the values descend; -0 equals +0.
inline std::uint32_t descending(float value) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(value == 0.0f ? 0.0f : value);
  const std::uint32_t ascending = (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
  return ~ascending;
}

}  // namespace

void top_k(std::span<const float> values, std::span<std::uint64_t> scratch,
           std::span<std::uint32_t> out) noexcept {
  for (std::size_t i = 0; i < values.size(); ++i) {
    scratch[i] = (std::uint64_t{descending(values[i])} << 32) | i;
  }
  const auto keys = scratch.first(values.size());
  const auto kth = keys.begin() + static_cast<std::ptrdiff_t>(out.size());
  if (kth != keys.end()) std::nth_element(keys.begin(), kth, keys.end());
  std::sort(keys.begin(), kth);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint32_t>(keys[i]);
}

}  // namespace vnreg::kernels
