// Which of many numbers are at most a limit: few, as a rule, and together.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// within[i] = 1 where values[i] <= limit, else 0.
void mark_within(const float* values, Index count, float limit, std::uint8_t* within) noexcept;

/// Calls use(i) for every i < count with values[i] <= limit, ascending. `count` is a multiple
/// of 16.
template <class Use>
void for_each_within(const float* values, Index count, float limit, const Use& use) noexcept {
  constexpr Index chunk = 256, word_bytes = 8;
  std::uint8_t within[chunk];
  for (Index first = 0; first < count; first += chunk) {
    const Index some = std::min(chunk, count - first);
    mark_within(values + first, some, limit, within);
    for (Index i = 0; i < some; i += word_bytes) {
      std::uint64_t word;
      std::memcpy(&word, within + i, sizeof(word));
      // Clears the lowest set bit at each turn; bytes ascend with the bits (little-endian).
      for (; word != 0; word &= word - 1) use(first + i + std::countr_zero(word) / 8);
    }
  }
}

/// The same for any count, where many numbers are within the limit, here and there: lists them
/// without a branch that they decide.
template <class Use>
void for_each_listed(const float* values, Index count, float limit, const Use& use) noexcept {
  constexpr Index chunk = 256;
  std::uint16_t listed[chunk];
  for (Index first = 0; first < count; first += chunk) {
    Index found = 0;
    for (Index i = 0; i < std::min(chunk, count - first); ++i) {
      listed[found] = static_cast<std::uint16_t>(i);
      found += values[first + i] <= limit ? 1 : 0;
    }
    for (Index i = 0; i < found; ++i) use(first + listed[i]);
  }
}

}  // namespace vnreg::kernels
